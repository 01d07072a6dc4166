"""Many rollouts of the swing-up at once on the rail, each with the noise and the body of its own generator."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from kendama_cli.errors import ConfigError
from kendama_cli.gym.rollout_options import RolloutOptions
from kendama_cli.learning.settings import LearnSettings
from kendama_cli.learning.state import SwingState
from kendama_cli.settings.game import GameSettings
from kendama_cli.simulation.swingup import rail_kernel as kernel
from kendama_cli.simulation.swingup.rail import CompiledRail, Rules


class RailRollouts:
    """``n`` rollouts; ``ends`` says how each ended (kernel.DUE: it goes on), ``misses_m`` by how much (NaN: caught)."""

    def __init__(self, n: int, hold_s: float, settings: LearnSettings, game: GameSettings) -> None:
        """Prepare n rollouts whose actions are held for ``hold_s``; raises ConfigError where a body's delay is
        longer.
        """
        self._n, self._settings, self._game = n, settings, game
        self._hold, self._at_most = round(hold_s / settings.step_s), max(1, round(settings.rollout_s / settings.step_s))
        rules = Rules.of(settings, game)
        self._rules = np.repeat(rules.packed()[0], n)
        self._catches = np.repeat(rules.packed_for_the_catch(), n)
        self._swings, self._tallies, self._before = np.zeros((n, 8)), np.zeros((n, kernel.TALLY)), np.zeros((n, 2))
        self._taken, self._delays = np.zeros(n, np.int64), np.zeros(n, np.int64)
        self.ends, self.misses_m = np.full(n, kernel.TIMEOUT), np.zeros(n)
        self._errors = np.zeros((3, n, -(-self._at_most // self._hold)))
        self._scales = [(1.0, 1.0, 1.0)] * n
        self._rail, self._on = CompiledRail(game, settings.step_s), (1.0, 1.0)
        self._check_delay(settings.randomisation.delay_s)

    @property
    def durations_s(self) -> NDArray[np.float64]:
        """Return how long each has taken, without the flight [s]."""
        return np.asarray(self._taken * self._settings.step_s, dtype=np.float64)

    def hold(self, wanted_m_s2: NDArray[np.float64]) -> None:
        """Hold an acceleration (n,) in every rollout that goes on."""
        kernel.hold_each(
            self._swings,
            self._tallies,
            self._taken,
            self.ends,
            self.misses_m,
            wanted_m_s2,
            self._errors_now()[2],
            self._before,
            self._delays,
            self._rules,
            self._catches,
            self._hold,
            self._at_most,
        )

    def readings(self) -> NDArray[np.float64]:
        """Return cup place and velocity, ball angle and rate, time left (n, 5); noisy where a rollout goes on."""
        s = self._swings
        across, above, across_rate = s[:, 1] - s[:, 0], s[:, 2], s[:, 4] - s[:, 3]
        angle_error, rate_error, _ = np.where(self.ends == kernel.DUE, self._errors_now(), 0.0)
        angle = np.arctan2(across, -above) + angle_error
        rate = (-above * across_rate + across * s[:, 5]) / (across * across + above * above) + rate_error
        angle = np.mod(angle + math.pi, 2.0 * math.pi) - math.pi
        left_s = self._settings.rollout_s - self.durations_s
        return np.stack([s[:, 0], s[:, 3], angle, rate, left_s], axis=1)

    def begin(self, which: NDArray[np.int64], options: RolloutOptions, rngs: Sequence[Generator]) -> None:
        """Hang the balls of ``which``, each with what its own of the generators (n,) draws: that of SwingUp."""
        if options.body is not None:
            self._check_delay(options.body.get("delay_s", 0.0))
        self._before[which], self._tallies[which], self._taken[which] = (0.0, 1.0), 0.0, 0
        self.ends[which], self.misses_m[which] = kernel.DUE, math.nan
        for i in which.tolist():
            noise = options.drawn(self._settings, rngs[i])
            at_holds = slice(None, None, self._hold)
            gains = noise.gain[: self._errors.shape[2]]
            self._errors[:, i] = noise.angle_rad[at_holds], noise.rate_rad_s[at_holds], gains
            self._delays[i] = noise.delay_steps
            scales = noise.workspace_scale, noise.rope_scale, noise.drag_scale
            if scales != self._scales[i]:
                self._scales[i] = scales
                rules = Rules.of(self._settings.with_workspace_scale(scales[0]), self._game, *scales[1:])
                self._rules[i], self._catches[i] = rules.packed()[0][0], rules.packed_for_the_catch()[0]
            if scales[1:] != self._on:
                self._on = scales[1:]
                self._rail.take_on(*self._on)
            self._rail.start(SwingState(noise.start_position_m, 0.0, noise.start_angle_rad, 0.0))
            self._swings[i] = self._rail.numbers

    def _errors_now(self) -> NDArray[np.float64]:
        """Return the errors of angle and rate, and factors on the acceleration (3, n), of the holds that come next."""
        held = np.minimum(self._taken // self._hold, self._errors.shape[2] - 1)
        return np.asarray(self._errors[:, np.arange(self._n), held])

    def _check_delay(self, delay_s: float) -> None:
        if round(delay_s / self._settings.step_s) > self._hold:
            raise ConfigError(
                "delay_s",
                f"a delay of {delay_s} s is longer than an action is held, {self._hold * self._settings.step_s:g} s; "
                "hold actions longer, or take a single environment",
            )
