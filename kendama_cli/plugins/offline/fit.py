"""Fit: four minutes of a swinging ball are recorded, and models are fitted to them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.random import Generator

from kendama_cli.learning.settings import LearnSettings
from kendama_cli.learning.state import SwingState
from kendama_cli.physics.taut_rope import Ball, rope_angle, rope_rate
from kendama_cli.plugins.offline.artifact import FittedModels
from kendama_cli.plugins.offline.engine import engine_of, network_steps
from kendama_cli.plugins.offline.messages import PredictionMessage
from kendama_cli.plugins.offline.network import trained
from kendama_cli.plugins.offline.recording import driven, free, smoothed, tracked, transitions, world
from kendama_cli.plugins.offline.settings import FitSettings
from kendama_cli.plugins.shared.kendama_fit import measure_kendama
from kendama_cli.schema.arrays import Array
from kendama_cli.settings.game import GameSettings
from kendama_cli.simulation.swingup.engine import SwingEngine
from kendama_cli.stages.interface import Metric, StageContext, StageResult

PREDICTED = "identified", "network", "wrong"
HELD_OUT_S = 40.0
"""Duration of the driven rollouts that no model is fitted to."""
HORIZON_S = 1.0
"""A prediction starts from the true state, and is compared so much later."""
LOGGED = 4
"""Every so many steps a prediction is logged."""


class Fit:
    """Needs nothing; gives the FittedModels of one recording."""

    def __init__(self, *, fit: FitSettings, learn: LearnSettings, game: GameSettings) -> None:
        self._settings, self._learn, self._game = fit, learn, game

    def run(self, given: Mapping[str, Any], ctx: StageContext) -> StageResult:
        """Record and fit; StageError is raised where no pendulum fits the free swing."""
        own, step_s = self._settings, self._learn.step_s
        played = world(own, self._game)
        swings = driven(own, self._learn, played, own.driven_s, _random(own, 1))
        rest = free(own, played, step_s)
        kendama = measure_kendama(tracked(rest, own, step_s, _random(own, 2)), self._game).kendama
        recordings = [*swings, rest]
        if own.network_data == "tracked":
            errors = _random(own, 5)
            recordings = [smoothed(one, own, step_s, errors) for one in recordings]
        network = trained(*transitions(recordings, network_steps(self._learn)), own, _random(own, 3))
        balls = np.concatenate(recordings)[:, :4]
        first, second, third = network.layers
        models = FittedModels(
            rope_m=kendama.rope_m,
            linear_n_s_m=kendama.linear_n_s_m,
            quadratic_n_s2_m2=kendama.quadratic_n_s2_m2,
            hanging_m=float(np.median(np.hypot(balls[:, 0], balls[:, 1]))),
            first=first,
            second=second,
            third=third,
            scale=network.scale,
            bounds=np.stack([balls.min(axis=0), balls.max(axis=0)]),
        )
        return StageResult(models, {**self._predicted(models, played, ctx), **_constants(models, played)})

    def _predicted(self, models: FittedModels, played: GameSettings, ctx: StageContext) -> dict[str, Metric]:
        """Predict rollouts that were not fitted, and return the rms distance at the horizon by model."""
        engines = [engine_of(one, models, self._settings, self._learn, self._game) for one in PREDICTED]
        errors: list[Array] = []
        steps = round(HORIZON_S / self._learn.step_s)
        fresh = driven(self._settings, self._learn, played, HELD_OUT_S, _random(self._settings, 4))
        for number, one in enumerate(fresh):
            for start in range(0, len(one) - steps, steps):
                predicted = np.stack([_open_loop(engine, one[start : start + steps + 1]) for engine in engines])
                errors.append(np.linalg.norm(predicted[:, -1] - one[start + steps, :2], axis=-1))
                for k in range(0, steps, LOGGED):
                    places = [one[start + 1 + k, :2], *predicted[:, k]]
                    angles = [rope_angle(*place.tolist()) for place in places]
                    t_s = (start + 1 + k) * self._learn.step_s
                    ctx.log.write("/fit/prediction", t_s, PredictionMessage(number, *angles))
        rms = 1e3 * np.sqrt(np.mean(np.square(errors), axis=0))
        return {f"{name}_error_mm": float(value) for name, value in zip(PREDICTED, rms, strict=True)}


def _random(settings: FitSettings, number: int) -> Generator:
    """Return a random stream of the recording: the policy's seed does not change the data."""
    return np.random.default_rng([settings.seed, number])


def _open_loop(engine: SwingEngine, recording: Array) -> Array:
    """Return the ball (steps, 2) of ``engine`` from the first row of ``recording`` on, under the same accelerations."""
    across, above, across_m_s, above_m_s, x_m, velocity_m_s, _ = recording[0].tolist()
    ball = Ball(across, above, across_m_s, above_m_s)
    engine.start(SwingState(x_m, velocity_m_s, rope_angle(ball.across_m, ball.above_m), rope_rate(ball)))
    places = []
    for acceleration in recording[1:, 6].tolist():
        engine.step(acceleration)
        places.append((engine.across_m, engine.above_m))
    return np.array(places)


def _constants(models: FittedModels, played: GameSettings) -> dict[str, Metric]:
    linear, quadratic = played.drag
    drag = models.linear_n_s_m + 3.0 * models.quadratic_n_s2_m2
    return {
        "rope_error_mm": 1e3 * (models.rope_m - played.rope.length_m),
        "drag_error": drag / (linear + 3.0 * quadratic) - 1.0,
    }
