"""Many rollouts of the swing-up at once on the rail, each with a noise and on a body of its own."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from kendama_cli.errors import ConfigError
from kendama_cli.gym.rollout_options import RolloutOptions
from kendama_cli.learning.settings import LearnSettings
from kendama_cli.learning.state import SwingState
from kendama_cli.settings.game import GameSettings
from kendama_cli.simulation.swingup import rail_kernel as kernel
from kendama_cli.simulation.swingup.noise import FURTHEST_ERROR
from kendama_cli.simulation.swingup.rail import CompiledRail, Rules


class RailRollouts:
    """``n`` rollouts; ``ends`` says how each ended (kernel.DUE: it goes on), ``misses_m`` by how much (NaN: caught)."""

    def __init__(self, n: int, hold_s: float, settings: LearnSettings, game: GameSettings) -> None:
        """An action is held for ``hold_s``; raises ConfigError where a body's delay is longer."""
        self._n, self._settings, self._game = n, settings, game
        self._hold, self._at_most = round(hold_s / settings.step_s), max(1, round(settings.rollout_s / settings.step_s))
        rules = Rules.of(settings, game)
        self._rules = np.repeat(rules.packed()[0], n)
        self._catches = np.repeat(rules.packed_for_the_catch(), n)
        self._swings, self._tallies, self._before = np.zeros((n, 8)), np.zeros((n, kernel.TALLY)), np.zeros((n, 2))
        self._taken, self._delays = np.zeros(n, np.int64), np.zeros(n, np.int64)
        self.ends, self.misses_m = np.full(n, kernel.TIMEOUT), np.zeros(n)
        self._noise, self._strength, self._offset = np.zeros(n), np.ones(n), np.zeros(n)
        self._scales: list[tuple[float, float, float]] = [(1.0, 1.0, 1.0)] * n
        self._rail, self._on = CompiledRail(game, settings.step_s), (1.0, 1.0)
        self._delay_steps(settings.bodies.delay_s)

    @property
    def durations_s(self) -> NDArray[np.float64]:
        """How long each has taken, without the flight [s]."""
        return np.asarray(self._taken * self._settings.step_s, dtype=np.float64)

    def hold(self, wanted_m_s2: NDArray[np.float64], rng: Generator) -> None:
        """Hold an acceleration (n,) in every rollout that goes on."""
        errors = rng.standard_normal(self._n).clip(-FURTHEST_ERROR, FURTHEST_ERROR)
        gains = (1.0 + self._noise * self._settings.noise.acceleration * errors) * self._strength
        kernel.hold_each(
            self._swings,
            self._tallies,
            self._taken,
            self.ends,
            self.misses_m,
            wanted_m_s2,
            gains,
            self._before,
            self._delays,
            self._rules,
            self._catches,
            self._hold,
            self._at_most,
        )

    def readings(self, rng: Generator) -> NDArray[np.float64]:
        """Cup place and velocity, ball angle and rate, time left (n, 5); noisy where a rollout goes on."""
        s, levels = self._swings, self._settings.noise
        across, above, across_rate = s[:, 1] - s[:, 0], s[:, 2], s[:, 4] - s[:, 3]
        errors = self._noise[:, None] * rng.standard_normal((self._n, 2))
        going = self.ends == kernel.DUE
        angle = np.arctan2(across, -above)
        angle += np.where(going, math.radians(levels.angle_reading_deg) * errors[:, 0] + self._offset, 0.0)
        rate = (-above * across_rate + across * s[:, 5]) / (across * across + above * above)
        rate += np.where(going, levels.rate_reading_rad_s * errors[:, 1], 0.0)
        angle = np.mod(angle + math.pi, 2.0 * math.pi) - math.pi
        left_s = self._settings.rollout_s - self.durations_s
        return np.stack([s[:, 0], s[:, 3], angle, rate, left_s], axis=1)

    def begin(self, which: NDArray[np.int64], options: RolloutOptions, rng: Generator) -> None:
        """Hang the balls of ``which``, each with a noise and on a body of its own."""
        m, levels = len(which), self._settings.noise
        starts = rng.standard_normal((m, 2))
        self._noise[which] = options.noise * rng.uniform(*self._settings.bodies.noise, m)
        bodies = self._bodies(m, options, rng)
        self._strength[which] = [body.strength for body in bodies]
        self._offset[which] = [body.offset_rad for body in bodies]
        self._delays[which] = [body.delay_steps for body in bodies]
        self._before[which], self._tallies[which], self._taken[which] = (0.0, 1.0), 0.0, 0
        self.ends[which], self.misses_m[which] = kernel.DUE, math.nan
        angles = self._noise[which] * math.radians(levels.start_angle_deg) * starts[:, 0]
        places = self._noise[which] * levels.start_position_m * starts[:, 1]
        for i, body, angle, place in zip(which.tolist(), bodies, angles.tolist(), places.tolist(), strict=True):
            if body.scales != self._scales[i]:
                self._scales[i] = body.scales
                rules = Rules.of(self._settings.with_workspace_scale(body.workspace), self._game, body.rope, body.drag)
                self._rules[i], self._catches[i] = rules.packed()[0][0], rules.packed_for_the_catch()[0]
            if body.scales[1:] != self._on:
                self._on = body.scales[1:]
                self._rail.take_on(*self._on)
            self._rail.start(SwingState(place, 0.0, angle, 0.0))
            self._swings[i] = self._rail.numbers

    def _bodies(self, m: int, options: RolloutOptions, rng: Generator) -> list[_Body]:
        """Draw ``m`` bodies, or take the one that was asked for."""
        drawn, asked, step_s = self._settings.bodies, options.body, self._settings.step_s
        if asked is not None:
            delay_steps = self._delay_steps(asked.get("delay_s", 0.0))
            offset = math.radians(asked.get("angle_deg", 0.0))
            scales = 1.0, asked.get("rope", 1.0), asked.get("drag", 1.0)
            return [_Body(*scales, asked.get("acceleration", 1.0), offset, delay_steps)] * m
        strengths, offsets, longer = rng.uniform(-1.0, 1.0, (3, m))
        narrower, later = rng.uniform(0.0, 1.0, (2, m))
        return [
            _Body(workspace, rope, drag, strength, offset_rad, round(drawn.delay_s * share / step_s))
            for workspace, rope, drag, strength, offset_rad, share in zip(
                (1.0 - drawn.narrowing * narrower).tolist(),
                (1.0 + drawn.rope * longer).tolist(),
                rng.uniform(*drawn.drag, m).tolist(),
                (1.0 + drawn.acceleration * strengths).tolist(),
                (math.radians(drawn.angle_deg) * offsets).tolist(),
                later.tolist(),
                strict=True,
            )
        ]

    def _delay_steps(self, delay_s: float) -> int:
        steps = round(delay_s / self._settings.step_s)
        if steps > self._hold:
            raise ConfigError(
                "delay_s",
                f"a delay of {delay_s} s is longer than an action is held, {self._hold * self._settings.step_s:g} s; "
                "hold actions longer, or take a single environment",
            )
        return steps


class _Body(NamedTuple):
    """What one rollout's body is: factors on workspace, rope, drag and acceleration; reading error; delay."""

    workspace: float
    rope: float
    drag: float
    strength: float
    offset_rad: float
    delay_steps: int

    @property
    def scales(self) -> tuple[float, float, float]:
        """What its rules are made of."""
        return self.workspace, self.rope, self.drag
