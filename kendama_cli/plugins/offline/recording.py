"""The fixed data: a ball that swings in a world of its own, recorded while the cup is driven and while it rests."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
from numpy.random import Generator
from scipy.signal import savgol_filter

from kendama_cli.learning.learners import begin_learner
from kendama_cli.learning.settings import LearnSettings, RandomSettings
from kendama_cli.learning.state import SwingState
from kendama_cli.learning.task_settings import RailEngine
from kendama_cli.plugins.offline.settings import FitSettings
from kendama_cli.plugins.shared.kendama_fit import FreeSwing
from kendama_cli.schema.arrays import Array
from kendama_cli.settings.game import GameSettings, MeasuredAir
from kendama_cli.simulation.swingup.engine import SwingEngine
from kendama_cli.simulation.swingup.environment import SwingUpEnvironment
from kendama_cli.simulation.swingup.rail import CompiledRail
from kendama_cli.simulation.swingup.rollout import RolloutNoise

COLUMNS = 7
"""Columns of a recording: the ball's x, z and their rates relative to the tie, the cup's x and velocity, its
acceleration in the step that led there."""


def strung(game: GameSettings, rope_m: float, drag: tuple[float, float]) -> GameSettings:
    """Return the game with a rope of ``rope_m`` and the drag coefficients ``drag``, k1 [N s/m] and k2 [N s^2/m^2]."""
    rope = dataclasses.replace(game.rope, length_m=rope_m)
    return dataclasses.replace(game, rope=rope, air=MeasuredAir("measured", *drag))


def unlike(settings: FitSettings, game: GameSettings, rope: float, drag: float) -> GameSettings:
    """Return the game with so many times the world's ``rope`` and ``drag``."""
    longer = dataclasses.replace(game, rope=dataclasses.replace(game.rope, length_m=settings.string_m))
    linear, quadratic = (settings.drag_scale * drag * one for one in longer.drag)
    return strung(game, settings.string_m * rope, (linear, quadratic))


def world(settings: FitSettings, game: GameSettings) -> GameSettings:
    """Return the world that is recorded."""
    made = unlike(settings, game, 1.0, 1.0)
    return dataclasses.replace(made, rope=dataclasses.replace(made.rope, stiffness_n_m=settings.stiffness_n_m))


def late(noise: RolloutNoise, settings: FitSettings, learn: LearnSettings) -> RolloutNoise:
    """Return the ``noise`` of a rollout in the world, whose cup obeys late."""
    return dataclasses.replace(noise, delay_steps=noise.delay_steps + round(settings.delay_s / learn.step_s))


def on_rail(learn: LearnSettings) -> LearnSettings:
    """Return the settings with the rail as their engine."""
    return dataclasses.replace(learn, engine=RailEngine("rail"))


def driven(
    settings: FitSettings, learn: LearnSettings, game: GameSettings, duration_s: float, rng: Generator
) -> list[Array]:
    """Return rollouts of random harmonics, each (steps, COLUMNS), at least ``duration_s`` of them together."""
    drawing = dataclasses.replace(on_rail(learn), learner=RandomSettings("random"))
    environment, learner = SwingUpEnvironment(drawing, game), begin_learner(drawing)
    rollouts: list[Array] = []
    recorded_s = 0.0
    while recorded_s < duration_s:
        rows: list[tuple[float, ...]] = []

        def record(t_s: float, swing: SwingEngine, acceleration: float, rows: list[tuple[float, ...]] = rows) -> None:
            rows.append(_row(swing, acceleration))

        learner.begin_rollout(rng)
        rollout = environment.roll_out(learner, late(environment.noise(rng), settings, learn), record)
        learner.end_rollout("timeout", rollout.final)  # so that no streak ever freezes what is drawn
        rollouts.append(np.array(rows))
        recorded_s += len(rows) * learn.step_s
    return rollouts


def free(settings: FitSettings, game: GameSettings, step_s: float) -> Array:
    """Return the ball (steps, COLUMNS) that is let go at ``free_angle_deg`` under a cup at rest."""
    swing = CompiledRail(game, step_s)
    swing.start(SwingState(0.0, 0.0, math.radians(settings.free_angle_deg), 0.0))
    rows = []
    for _ in range(round(settings.free_s / step_s)):
        swing.step(0.0)
        rows.append(_row(swing, 0.0))
    return np.array(rows)


def tracked(recording: Array, settings: FitSettings, step_s: float, rng: Generator) -> FreeSwing:
    """Return a ``recording`` as a camera sees it: fewer positions, each with an error."""
    every = max(1, round(1.0 / (settings.track_rate_hz * step_s)))
    seen = recording[::every, :2]
    error = settings.track_sigma_m * rng.standard_normal(seen.shape)
    return FreeSwing(np.asarray(every * step_s * np.arange(len(seen)), np.float64), seen + error)


def smoothed(recording: Array, settings: FitSettings, step_s: float, rng: Generator) -> Array:
    """Return the ``recording`` with the ball's states from measured positions, by least squares of cubics.

    A. Savitzky and M. Golay, Analytical Chemistry 36, 1964.
    """
    window = 2 * max(2, round(0.5 * settings.smoothing_s / step_s)) + 1
    seen = recording[:, :2] + settings.track_sigma_m * rng.standard_normal((len(recording), 2))
    ball = [savgol_filter(seen, window, 3, deriv=order, delta=step_s, axis=0) for order in (0, 1)]
    return np.column_stack([*ball, recording[:, 4:]])


def transitions(recordings: list[Array], steps: int) -> tuple[Array, Array]:
    """Return inputs (n, 6) and changes (n, 4) over so many ``steps``, of every step of the recordings."""
    inputs, changes = [], []
    for one in recordings:
        before, after = one[:-steps], one[steps:]
        sums = np.concatenate([[0.0], np.cumsum(one[:, 6])])
        mean = (sums[steps + 1 :] - sums[1:-steps]) / steps
        inputs.append(np.column_stack([before[:, :4], mean, before[:, 5]]))
        changes.append(after[:, :4] - before[:, :4])
    return np.concatenate(inputs), np.concatenate(changes)


def _row(swing: SwingEngine, acceleration: float) -> tuple[float, ...]:
    ball = swing.across_m, swing.above_m, swing.across_m_s, swing.above_m_s
    return *ball, swing.x_m, swing.velocity_m_s, acceleration
