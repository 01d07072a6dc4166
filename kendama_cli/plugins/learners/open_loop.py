"""An open loop that is improved rollout by rollout: a swing of a few parameters, searched with CMA-ES.

The cup's wanted place is a harmonic whose frequency changes evenly,

    x(t) = A sin(w t + c t^2 / 2),

and the cup follows it by its own place and speed. The ball is not looked at: the acceleration changes every
``learn.decision.max_s`` and is held until then. A generation of variations of the swing is tried, each once; what
it costs is the reward that it lacks and, where the ball was not released, how far from high it stayed. Where enough of
a generation succeed, the centre of the search is replayed as the greedy policy, until it fails; then the next
generation is tried. After ``restart_after`` generations in a row without a success, at a near miss that leads no
farther, the search begins anew.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Mapping
from typing import Any, Protocol, Self

import numpy as np
from numpy.random import Generator

from kendama_cli.artifacts.policy import PolicyArtifact
from kendama_cli.learning.decision import NEVER_S, ROUNDING_S, task_meaning
from kendama_cli.learning.interface import FinishedRollout, LearnerMaker
from kendama_cli.learning.parameter_search import Generation, parameter_search
from kendama_cli.learning.reward import Outcome
from kendama_cli.learning.rewarded_actor import CountingActor, RewardedActor, RolloutLearner
from kendama_cli.learning.settings import LearnSettings
from kendama_cli.learning.state import SwingState
from kendama_cli.learning.statistics import LearningCount
from kendama_cli.learning.task_settings import RewardSettings
from kendama_cli.plugins.learners.settings import BayesSettings, OpenLoopSettings
from kendama_cli.schema.arrays import Array

PARAMETERS = 3
"""Of a swing: w [rad/s], c [rad/s^2], A [m]."""
FOLLOWING_PER_S = 4.0
"""The share of the error in place that is made up in a second."""


def wanted(swing: tuple[float, float, float], t_s: float, x_m: float, velocity_m_s: float, ahead_s: float) -> float:
    """Return the acceleration that follows x = A sin(w t + c t^2 / 2), the ``swing`` w, c, A.

    It brings the cup to the speed that the swing has ``ahead_s`` later, and some way to its place now.
    """
    w, c, size = swing
    later = t_s + ahead_s
    speed = size * (w + c * later) * math.cos((w + 0.5 * c * later) * later)
    place = size * math.sin((w + 0.5 * c * t_s) * t_s)
    return (speed + FOLLOWING_PER_S * (place - x_m) - velocity_m_s) / ahead_s


class OpenLoopPolicy:
    """Policy of one swing; the readings of the ball play no part."""

    table = None
    decides_on_bins = True  # every longest_s there is a decision, whatever the bins

    def __init__(self, artifact: PolicyArtifact, settings: LearnSettings) -> None:
        """Raise ValueError if the artifact does not hold one swing."""
        self._low, self._high = settings.actions_m_s2[0], settings.actions_m_s2[-1]
        self._period_s = settings.decision.max_s
        self.play(swing_of(artifact))

    def play(self, swing: Array) -> None:
        """Begin a rollout that plays ``swing`` (3,)."""
        self._swing = swing
        frequency, chirp, amplitude = swing.tolist()
        self._numbers = frequency, chirp, amplitude
        self.next_look_s = NEVER_S
        self._acceleration = 0.0
        self.decisions = 0
        self.highest_rad = 0.0

    def begin_rollout(self) -> None:
        """Begin the same swing anew."""
        self.play(self._swing)

    def act(self, state: SwingState, t_s: float) -> float:
        """Return the cup's acceleration [m/s^2] at ``t_s`` into the rollout."""
        self.highest_rad = max(self.highest_rad, abs(state.angle_rad))
        if t_s >= self.next_look_s:
            asked = wanted(self._numbers, t_s, state.x_m, state.velocity_m_s, self._period_s)
            self._acceleration = max(self._low, min(self._high, asked))
            self.next_look_s = t_s + self._period_s - ROUNDING_S
            self.decisions += 1
        return self._acceleration


class SwingActor(CountingActor, Protocol):
    """Actor that plays a swing."""

    def play(self, swing: Array) -> None:
        """Begin a rollout that plays ``swing`` (3,)."""


class SwingLearner(RolloutLearner):
    """Learner that replays a swing until it fails, and seals that of the longest streak while it was frozen."""

    _actor: SwingActor

    def __init__(
        self,
        settings: LearnSettings,
        start: Array,
        policy: PolicyArtifact | None,
        actor: Callable[[PolicyArtifact, LearnSettings], SwingActor],
    ) -> None:
        """Start from the swing ``start`` (3,), or from that of a ``policy``."""
        self._settings = settings
        self.count = LearningCount(succeeded_ever=policy is not None)
        self._greedy = self._best = start if policy is None else swing_of(policy)
        self._best_streak, self._explored = 0, False
        self._actor = actor(sealed_swing(self._greedy, settings), settings)
        self._rollout = RewardedActor(self._actor, settings.reward)

    @classmethod
    def from_state(cls, settings: LearnSettings, state: Mapping[str, Any]) -> Self:
        """Return the learner that ``state()`` described, between the same two rollouts."""
        learner = cls(settings)  # type: ignore[call-arg]  # as the learners of this folder are made
        learner._restore(state)
        return learner

    def _restore(self, state: Mapping[str, Any]) -> None:
        self.count = LearningCount(**state["count"])
        self._greedy, self._best = np.array(state["greedy"]), np.array(state["best"])
        self._best_streak = int(state["best_streak"])

    def state(self) -> dict[str, Any]:
        """Return the learner between two rollouts: arrays and JSON values."""
        return {
            "count": dataclasses.asdict(self.count),
            "greedy": self._greedy.tolist(),
            "best": self._best.tolist(),
            "best_streak": self._best_streak,
        }

    @property
    def policy(self) -> PolicyArtifact:
        """The swing that is replayed, unless an earlier one had the longer streak while it was frozen; sealed."""
        longer = self._best_streak > self.count.streak
        return sealed_swing(self._best if longer else self._greedy, self._settings)

    def _play(self, swing: Array) -> None:
        self._actor.play(swing)
        self._rollout = RewardedActor(self._actor, self._settings.reward)

    def _counted(self, reward: float, *, success: bool) -> FinishedRollout:
        """Count a rollout that has ended, and keep the swing of the longest streak."""
        longer = max(self._settings.count.learned_streak, self._best_streak + 1)
        if not (self._explored or success) and self.count.streak >= longer:
            self._best, self._best_streak = self._greedy, self.count.streak
        self.count = self.count.after(explored=self._explored, success=success, settings=self._settings.count)
        return FinishedRollout(self.count.rollouts, self._explored, success, reward, self._rollout.decisions)


class OpenLoopLearner(SwingLearner):
    """Tries generations of swings, and replays the centre of the search once it is good. See the module."""

    _actor: OpenLoopPolicy

    def __init__(self, settings: LearnSettings, policy: PolicyArtifact | None = None) -> None:
        """Start from the centre of the settings' ranges, or from the swing of a ``policy``, which is replayed first."""
        assert isinstance(settings.learner, OpenLoopSettings)
        centre, self._spread = ranges(settings)
        super().__init__(settings, centre, policy, OpenLoopPolicy)
        self._own, self._centre = settings.learner, self._greedy
        self._costs: list[list[float]] = [[]]
        self._seed: int | None = None
        self._generation: Generation | None = None
        self._replays = policy is not None
        self._successes = self._barren = 0

    def _restore(self, state: Mapping[str, Any]) -> None:
        super()._restore(state)
        self._centre = np.array(state["centre"])
        self._costs, self._seed = [list(one) for one in state["costs"]], state["seed"]
        self._successes, self._barren = int(state["successes"]), int(state["barren"])
        self._replays = bool(state["replays"])

    def state(self) -> dict[str, Any]:
        """Return the learner between two rollouts, as JSON values."""
        return {
            **super().state(),
            "centre": self._centre.tolist(),
            "costs": [list(one) for one in self._costs],
            "seed": self._seed,
            "successes": self._successes,
            "barren": self._barren,
            "replays": self._replays,
        }

    def begin_rollout(self, rng: Generator) -> None:
        """Replay the centre, or try the next swing of the generation; the first rollout draws the search's seed."""
        if self._seed is None:
            self._seed = int(rng.integers(2**31))
        self._explored = not self._replays
        self._play(self._swing(self._searched().proposals[len(self._costs[-1])]) if self._explored else self._greedy)

    def end_rollout(self, outcome: Outcome, state: SwingState, miss_m: float | None = None) -> FinishedRollout:
        """Count, and put what a variation cost to its generation; ``state`` is the last reading."""
        success, reward = outcome == "goal", self._rollout.reward(outcome, state, miss_m)
        if self._explored:
            self._successes += success
            self._costs[-1].append(self._cost(reward, outcome))
            if len(self._costs[-1]) == self._own.generation:
                self._end_generation()
        else:
            self._replays = success
        return self._counted(reward, success=success)

    def _cost(self, reward: float, outcome: Outcome) -> float:
        """Return the reward lost, less up to half of a near miss's for a ball that swung high."""
        settings = self._settings.reward
        return settings.goal - worth(settings, reward, outcome, self._actor.highest_rad)

    def _end_generation(self) -> None:
        self._costs.append([])
        self._generation = None
        self._replays = self._successes >= self._own.replay_from * self._own.generation
        if self._replays or not self.count.streak:
            self._greedy = self._swing(self._searched().best)
        self._barren = 0 if self._successes else self._barren + 1
        if self._barren == self._own.restart_after:
            self._costs, self._seed, self._barren = [[]], None, 0
        self._successes = 0

    def _searched(self) -> Generation:
        if self._generation is None:
            assert self._seed is not None
            search = parameter_search(
                self._own.search,
                PARAMETERS,
                self._seed,
                generation=self._own.generation,
                elite=self._own.generation,
                reward_cost=0.5 * self._settings.reward.goal,
            )
            self._generation = search.after(self._costs[:-1])
        return self._generation

    def _swing(self, parameters: Array) -> Array:
        swing: Array = self._centre + self._spread * parameters
        return swing


def worth(settings: RewardSettings, reward: float, outcome: Outcome, highest_rad: float) -> float:
    """Return a rollout's reward, and up to half of a near miss's where the ball was not released but swung high."""
    swung = min(1.0, (1.0 - math.cos(highest_rad)) / 2.0)
    return reward + (0.5 * settings.missed * swung if outcome in ("timeout", "outside") else 0.0)


def ranges(settings: LearnSettings) -> tuple[Array, Array]:
    """Return the centre and the first standard deviation of the search."""
    own = settings.learner
    assert isinstance(own, OpenLoopSettings | BayesSettings)
    low_high = np.array([own.frequency_rad_s, own.chirp_rad_s2, own.amplitude])
    low_high[2] *= settings.workspace.half_width_m
    return low_high.mean(axis=1), 0.5 * (low_high[:, 1] - low_high[:, 0])


def sealed_swing(swing: Array, settings: LearnSettings) -> PolicyArtifact:
    """Return the policy that plays ``swing`` (3,), of the learner that ``settings`` choose."""
    return PolicyArtifact.seal(settings.learner.kind, task_meaning(settings), {"swing": np.array(swing)})


def swing_of(artifact: PolicyArtifact) -> Array:
    """Return the swing (3,) of a policy; raises ValueError where the artifact does not hold one."""
    values: Array = artifact.array("swing")
    if values.shape != (PARAMETERS,):
        raise ValueError(f"the swing has shape {values.shape}; allowed: ({PARAMETERS},), frequency, chirp, amplitude")
    return np.array(values)


OPEN_LOOP = LearnerMaker(
    begin=OpenLoopLearner, resume=OpenLoopLearner.from_state, policy=OpenLoopPolicy, meaning=task_meaning
)
"""The kind ``open_loop``."""
