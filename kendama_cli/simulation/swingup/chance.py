"""Random baseline: the fraction of random harmonics that succeed, which every task is to be read beside."""

from __future__ import annotations

import dataclasses
import functools

import numpy as np

from kendama_cli.learning.learner_settings import RandomSettings
from kendama_cli.learning.learners import begin_learner
from kendama_cli.learning.settings import LearnSettings
from kendama_cli.learning.task_settings import RailEngine
from kendama_cli.settings.game import GameSettings
from kendama_cli.simulation.swingup.environment import SwingUpEnvironment
from kendama_cli.simulation.swingup.rail import without_rope_mass

ROLLOUTS = 400
_SEED = 324


@functools.lru_cache(maxsize=16)
def random_success_rate(settings: LearnSettings, game: GameSettings) -> float:
    """Share of ROLLOUTS rollouts, each driven by a newly drawn harmonic on the rail, that succeed; always the same."""
    drawing = dataclasses.replace(settings, learner=RandomSettings("random"), engine=RailEngine("rail"))
    environment, learner = SwingUpEnvironment(drawing, without_rope_mass(game)), begin_learner(drawing)
    noise_rng, harmonic_rng = np.random.default_rng([_SEED, 1]), np.random.default_rng([_SEED, 2])
    succeeded = 0
    for _ in range(ROLLOUTS):
        learner.begin_rollout(harmonic_rng)
        rollout = environment.roll_out(learner, environment.noise(noise_rng))
        learner.end_rollout("timeout", rollout.final)  # so that no streak ever freezes what is drawn
        succeeded += rollout.success
    return succeeded / ROLLOUTS
