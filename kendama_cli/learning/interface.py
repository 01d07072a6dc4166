"""The interfaces of what learns the swing-up and of what acts by it.

A learner of another project implements ``Learner`` and ``Policy``, bundles what makes them in a ``LearnerMaker``, and
names that in a ``Variant`` of the entry point group ``kendama.learners``.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Protocol

from numpy.random import Generator

from kendama_cli.artifacts.policy import PolicyArtifact
from kendama_cli.learning.reward import Outcome
from kendama_cli.learning.settings import LearnSettings
from kendama_cli.learning.state import SwingState
from kendama_cli.learning.statistics import LearningCount
from kendama_cli.log.messages import RolloutMessage
from kendama_cli.schema.arrays import Array


class PlayedSwingUp(Protocol):
    """A swing-up that was played, in simulation or on a robot."""

    @property
    def duration_s(self) -> float: ...
    @property
    def peak_displacement_m(self) -> float: ...
    @property
    def half_swings(self) -> int: ...


@dataclass(frozen=True)
class FinishedRollout:
    """Data of a rollout for the learner at its end; ``index`` counts from 1, ``actions`` counts its decisions."""

    index: int
    explored: bool
    success: bool
    reward: float
    actions: int

    def message(self, swing: PlayedSwingUp) -> RolloutMessage:
        """Return the message of this rollout, which ``swing`` played."""
        return RolloutMessage(
            index=self.index,
            explored=self.explored,
            reward=self.reward,
            success=self.success,
            duration_s=swing.duration_s,
            peak_displacement_m=swing.peak_displacement_m,
            half_swings=swing.half_swings,
        )


class Actor(Protocol):
    """Choice of the cup's acceleration from readings: a learner, a policy, or a script."""

    @property
    def decides_on_bins(self) -> bool:
        """Return True if ``act`` changes its answer only when ``learn.decision`` and the bins of ``learn.grid``
        require it.

        Compiled code then finds the next decision itself. Any other actor is asked at every reading that it wants.
        """

    @property
    def next_look_s(self) -> float:
        """``act`` changes nothing before this time into the rollout, so no reading is needed before it [s]."""

    def act(self, state: SwingState, t_s: float) -> float:
        """Return the cup's acceleration [m/s^2] at ``t_s`` into the rollout, within ``learn.actions_m_s2``."""


class Policy(Actor, Protocol):
    """Acts by what was learned and learns no more: the same readings give the same accelerations."""

    @property
    def table(self) -> Array | None:
        """Values of the actions by state (states, actions), to show; None where it keeps no such table."""

    def begin_rollout(self) -> None:
        """Forget the last rollout."""


class Learner(Actor, Protocol):
    """Learns from rollouts: ``begin_rollout``, ``act`` as often as there are readings, ``end_rollout``.

    It is made by a LearnerMaker. All that is random comes from the generator handed to ``begin_rollout``. Where
    ``count`` says frozen, the next rollout validates: it acts as ``policy`` does, and nothing is learned from it.
    """

    @property
    def count(self) -> LearningCount:
        """Rollouts so far, and how far learning has come by the counting rule."""

    @property
    def table(self) -> Array | None:
        """Values of the actions by state (states, actions), to show; None where it keeps no such table."""

    @property
    def policy(self) -> PolicyArtifact:
        """Return the policy that would be used if learning ended now, sealed."""

    def begin_rollout(self, rng: Generator) -> None:
        """Begin a rollout, exploring or not; ``rng`` serves until it ends."""

    def end_rollout(self, outcome: Outcome, state: SwingState, miss_m: float | None = None) -> FinishedRollout:
        """Learn from the end of the rollout and count it; ``state`` is the last reading.

        ``miss_m`` is the distance from the cup's axis at which the ball came down after a release, where that was seen.
        """

    def state(self) -> dict[str, Any]:
        """Return the state to save between two rollouts: arrays and JSON values by name.

        A learner that resumes from it does bit for bit the same as one that was never interrupted.
        """


@dataclass(frozen=True)
class LearnerMaker:
    """Maker of the learners and policies of one kind; ``makes`` of its Variant names one of these.

    ``begin`` gives a learner before its first rollout: from nothing, or from a verified policy that it is to go on
    from. ``resume`` gives the one that ``Learner.state`` described. ``policy`` gives what acts by an artifact, and
    raises ValueError, in one line, where its arrays are not what the settings need. ``meaning`` gives, as JSON values,
    the settings that must be the same wherever an artifact is acted by: it is sealed with them, and nothing moves
    where they differ.
    """

    begin: Callable[[LearnSettings, PolicyArtifact | None], Learner]
    resume: Callable[[LearnSettings, Mapping[str, Any]], Learner]
    policy: Callable[[PolicyArtifact, LearnSettings], Policy]
    meaning: Callable[[LearnSettings], Mapping[str, object]]
