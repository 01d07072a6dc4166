"""Tables that learn from whole rollouts instead of temporal differences: peers of SARSA(lambda) that bootstrap nothing.

``monte_carlo`` moves the value of every choice towards the discounted reward that followed it (Sutton and Barto, 2nd
edition, section 5.4, every visit, with a constant step). ``clone`` counts how often successful rollouts made each
choice, and takes the most frequent: behavioural cloning of its own successes. Exploration, bins and times of decision
are those of ``sarsa``.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from kendama_cli.artifacts.policy import PolicyArtifact
from kendama_cli.learning.decision import GreedyPolicy, task_meaning
from kendama_cli.learning.interface import FinishedRollout, LearnerMaker
from kendama_cli.learning.reward import Outcome
from kendama_cli.learning.sarsa import SarsaLearner, ValueTable
from kendama_cli.learning.settings import LearnSettings
from kendama_cli.learning.state import SwingState
from kendama_cli.learning.updates import Transition


class ReturnTable(ValueTable):
    """Q(s, a) += alpha [r + gamma r' + ... - Q(s, a)] for every choice of a rollout, at its end."""

    _visits: tuple[Transition, ...] = ()

    def begin(self) -> None:
        """Forget the last rollout."""
        self._visits = ()

    def update(self, transition: Transition, alpha: float) -> float:
        """Remember one choice; learn from all of them at the rollout's end, and return the last one's error."""
        self._visits = (*self._visits, transition)
        error, following = 0.0, 0.0
        if transition.next_row is None:
            for visit in reversed(self._visits):
                following = visit.reward + self._gamma * following
                error = following - float(self.q[visit.row, visit.column])
                self.q[visit.row, visit.column] += alpha * error
        return error


class CountTable(ValueTable):
    """Counts of the choices of successful rollouts."""

    def update(self, transition: Transition, alpha: float) -> float:
        """Learn nothing from single choices."""
        return 0.0

    def add(self, choices: list[tuple[int, int]]) -> None:
        """Count the ``choices`` (row, column) of a successful rollout."""
        np.add.at(self.q, tuple(np.array(choices).T), 1.0)


class MonteCarloLearner(SarsaLearner):
    """Every-visit Monte Carlo control on the table of ``sarsa``."""

    def _begin_values(self, q: NDArray[np.float64] | None) -> ReturnTable:
        table = super()._begin_values(q)
        return ReturnTable(table.q, gamma=self._settings.gamma, trace_decay=1.0)


class CloneLearner(SarsaLearner):
    """Takes the action that successful rollouts took most often in a state."""

    _values: CountTable

    def _begin_values(self, q: NDArray[np.float64] | None) -> CountTable:
        table = super()._begin_values(q)
        return CountTable(table.q, gamma=1.0, trace_decay=1.0)

    def end_rollout(self, outcome: Outcome, state: SwingState, miss_m: float | None = None) -> FinishedRollout:
        """Count the choices of a success, and the rollout; ``state`` is the last reading."""
        if outcome == "goal" and self._alpha and self._held.row >= 0:
            choices = [(one.row, one.column) for one in self._transitions]
            self._values.add([*choices, (self._held.row, self._held.column)])
        return super().end_rollout(outcome, state, miss_m)


def _monte_carlo(settings: LearnSettings, policy: PolicyArtifact | None) -> MonteCarloLearner:
    return MonteCarloLearner(settings, q=None if policy is None else policy.array("q"))


def _clone(settings: LearnSettings, policy: PolicyArtifact | None) -> CloneLearner:
    return CloneLearner(settings, q=None if policy is None else policy.array("q"))


MONTE_CARLO = LearnerMaker(
    begin=_monte_carlo, resume=MonteCarloLearner.from_state, policy=GreedyPolicy, meaning=task_meaning
)
"""The kind ``monte_carlo``."""
CLONE = LearnerMaker(begin=_clone, resume=CloneLearner.from_state, policy=GreedyPolicy, meaning=task_meaning)
"""The kind ``clone``."""
