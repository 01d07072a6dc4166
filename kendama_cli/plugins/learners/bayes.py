"""An open loop by Bayesian optimisation: a Gaussian process over the three numbers of a chirp, and its upper bound.

The swing is that of ``open_loop``; a swing's worth is the rollout's reward over that of the goal, with up to half of a
near miss's for a ball that swung high. Until the first success, and after each failure of the swing that is replayed,
the next rollout plays the swing of the highest upper confidence bound (N. Srinivas et al., ICML 2010); then the one of
the highest posterior mean is replayed. No rollout looks at the ball.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.random import Generator
from scipy.linalg import cho_factor, cho_solve

from kendama_cli.artifacts.policy import PolicyArtifact
from kendama_cli.learning.decision import task_meaning
from kendama_cli.learning.exploration import explores
from kendama_cli.learning.interface import FinishedRollout, LearnerMaker
from kendama_cli.learning.reward import Outcome
from kendama_cli.learning.settings import LearnSettings
from kendama_cli.learning.state import SwingState
from kendama_cli.plugins.learners.open_loop import PARAMETERS, OpenLoopPolicy, SwingLearner, ranges, worth
from kendama_cli.plugins.learners.settings import BayesSettings
from kendama_cli.schema.arrays import Array

NEAR = 0.1
"""Half of the candidates lie this near to the best swings so far, in standard deviations of the ranges."""


class GaussianProcess:
    """A zero-mean Gaussian process with k(a, b) = exp(-|a - b|^2 / (2 length^2)) and noise (Rasmussen and Williams
    2006, algorithm 2.1).
    """

    def __init__(self, points: Array, values: Array, length: float, noise: float) -> None:
        """Condition on ``values`` (n,) at ``points`` (n, d)."""
        self._points, self._length = points, length
        self._factor = cho_factor(self._kernel(points, points) + noise**2 * np.eye(len(points)), lower=True)
        self._weights = cho_solve(self._factor, values)

    def posterior(self, points: Array) -> tuple[Array, Array]:
        """Return mean and standard deviation (m,) at ``points`` (m, d)."""
        across = self._kernel(points, self._points)
        variance = 1.0 - np.einsum("ij,ji->i", across, cho_solve(self._factor, across.T))
        return across @ self._weights, np.sqrt(np.maximum(variance, 0.0))

    def _kernel(self, one: Array, other: Array) -> Array:
        apart = ((one[:, None] - other[None]) ** 2).sum(axis=-1)
        kernel: Array = np.exp(-0.5 * apart / self._length**2)
        return kernel


class BayesLearner(SwingLearner):
    """Plays the swing of the highest bound, and replays that of the highest mean. See the module."""

    _actor: OpenLoopPolicy

    def __init__(self, settings: LearnSettings, policy: PolicyArtifact | None = None) -> None:
        """Start from nothing, or from the swing of a ``policy``, which is replayed until it fails."""
        assert isinstance(settings.learner, BayesSettings)
        self._own = settings.learner
        self._centre, self._spread = ranges(settings)
        super().__init__(settings, self._centre, policy, OpenLoopPolicy)
        self._points, self._worths = np.zeros((0, PARAMETERS)), np.zeros(0)
        self._present = self._greedy

    def _restore(self, state: Mapping[str, Any]) -> None:
        super()._restore(state)
        self._points, self._worths = np.array(state["points"]), np.array(state["worths"])

    def state(self) -> dict[str, Any]:
        """Return the learner between two rollouts: what was played, what it was worth, and JSON values."""
        return {**super().state(), "points": np.array(self._points), "worths": np.array(self._worths)}

    def begin_rollout(self, rng: Generator) -> None:
        """Replay the best swing, or play the one of the highest bound among candidates from ``rng``."""
        frozen = self.count.frozen(self._settings.count)
        self._explored = not frozen and explores(1.0, self.count, rng)
        if self._explored:
            self._present = self._swing(self._highest(self._candidates(rng), self._own.optimism))
        else:
            if len(self._points) and not self.count.streak:
                self._greedy = self._swing(self._highest(self._points, 0.0))
            self._present = self._greedy
        self._play(self._present)

    def end_rollout(self, outcome: Outcome, state: SwingState, miss_m: float | None = None) -> FinishedRollout:
        """Add what the swing was worth, and count; ``state`` is the last reading."""
        success, reward = outcome == "goal", self._rollout.reward(outcome, state, miss_m)
        if not self.count.frozen(self._settings.count):
            found = worth(self._settings.reward, reward, outcome, self._actor.highest_rad)
            point = (self._present - self._centre) / self._spread
            self._points = np.vstack([self._points, point])
            self._worths = np.append(self._worths, found / self._settings.reward.goal)
        return self._counted(reward, success=success)

    def _candidates(self, rng: Generator) -> Array:
        anywhere = rng.uniform(-self._own.reach, self._own.reach, (self._own.candidates, PARAMETERS))
        if not len(self._points):
            return anywhere
        best = self._points[np.argsort(-self._worths, kind="stable")[:5]]
        near = best[rng.integers(len(best), size=len(anywhere))] + NEAR * rng.standard_normal(anywhere.shape)
        return np.vstack([anywhere, near])

    def _highest(self, points: Array, optimism: float) -> Array:
        """Return which of ``points`` has the highest mean plus ``optimism`` standard deviations."""
        if not len(self._points):
            return np.asarray(points[0])
        process = GaussianProcess(self._points, self._worths, self._own.length, self._own.noise)
        mean, deviation = process.posterior(points)
        return np.asarray(points[int(np.argmax(mean + optimism * deviation))])

    def _swing(self, point: Array) -> Array:
        return np.asarray(self._centre + self._spread * point)


BAYES = LearnerMaker(begin=BayesLearner, resume=BayesLearner.from_state, policy=OpenLoopPolicy, meaning=task_meaning)
"""The kind ``bayes``."""
