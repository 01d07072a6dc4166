"""Updates of a table of values: the target of a choice, and the eligibility traces of earlier choices.

Every update moves Q(s, a) toward r + gamma V, and they differ in V alone (Sutton and Barto, 2nd edition, chapter 6):

    sarsa           V = Q(s', a')                     the action chosen there
    expected_sarsa  V = sum_b pi(b | s') Q(s', b)     what the behaviour chooses on average
    q               V = max_b Q(s', b)                Watkins: traces end where the choice is not the best
    double_sarsa    V = Q2(s', a')                    a coin draws which of two tables learns from the other

A sampled harmonic is deterministic, and so is the greedy policy: there expected_sarsa is sarsa.

Traces (equations.md eq. 7) first fade by gamma lambda; then the visited entry is marked: *replacing* sets it to 1
(Singh and Sutton 1996; the paper's choice), *accumulating* adds 1, *dutch* adds 1 after shrinking it by 1 - alpha (van
Seijen and Sutton 2014), which with a correction of the update makes it the online lambda-return exactly.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

UpdateName = Literal["sarsa", "expected_sarsa", "q", "double_sarsa"]


class Transition(NamedTuple):
    """One choice and what came of it; ``next_row`` is None where the rollout ended.

    ``action_probabilities`` are the probabilities of the next columns; None where ``next_column`` was certain.
    """

    row: int
    column: int
    reward: float
    next_row: int | None
    next_column: int | None
    action_probabilities: Sequence[float] | None = None


class Update(Protocol):
    """One line of the table above."""

    tables: int

    def ahead(self, q: NDArray[np.float64], transition: Transition) -> float:
        """Return V from the table ``q`` for a transition that has a next row."""

    def goes_on(self, q: NDArray[np.float64], transition: Transition) -> bool:
        """Return True if earlier choices have a part in the value after this transition."""


class Sarsa:
    """V = Q(s', a')."""

    tables = 1

    def ahead(self, q: NDArray[np.float64], transition: Transition) -> float:
        """Return the value of the action chosen next."""
        return float(q[transition.next_row, transition.next_column])

    def goes_on(self, q: NDArray[np.float64], transition: Transition) -> bool:
        """Return True: the update is on-policy."""
        return True


class DoubleSarsa(Sarsa):
    """V = Q2(s', a'): ``ahead`` is given the other of two tables."""

    tables = 2


class ExpectedSarsa(Sarsa):
    """V = sum_b pi(b | s') Q(s', b)."""

    def ahead(self, q: NDArray[np.float64], transition: Transition) -> float:
        """Return the mean value of the next action."""
        if transition.action_probabilities is None:
            return super().ahead(q, transition)
        return float(np.dot(transition.action_probabilities, q[transition.next_row]))


class WatkinsQ:
    """V = max_b Q(s', b)."""

    tables = 1

    def ahead(self, q: NDArray[np.float64], transition: Transition) -> float:
        """Return the maximum value in the next row."""
        return float(q[transition.next_row].max())

    def goes_on(self, q: NDArray[np.float64], transition: Transition) -> bool:
        """Return True along greedy choices only."""
        row = q[transition.next_row]
        return bool(row[transition.next_column] == row.max())


UPDATES: dict[UpdateName, Update] = {
    "sarsa": Sarsa(),
    "expected_sarsa": ExpectedSarsa(),
    "q": WatkinsQ(),
    "double_sarsa": DoubleSarsa(),
}


TraceName = Literal["replacing", "accumulating", "dutch"]


class TraceLaw(Protocol):
    """One of the laws."""

    exact: bool
    """Whether the update is corrected for how the value of the state has changed since it was looked ahead to."""

    def marked(self, faded: float, alpha: float) -> float:
        """Return the new trace of an entry that was chosen, from its trace ``faded`` just now."""


class Replacing:
    """e = 1."""

    exact = False

    def marked(self, faded: float, alpha: float) -> float:
        """Return 1, however often the state occurred before."""
        return 1.0


class Accumulating:
    """e = e + 1."""

    exact = False

    def marked(self, faded: float, alpha: float) -> float:
        """Return the trace plus one."""
        return faded + 1.0


class Dutch:
    """e = (1 - alpha) e + 1."""

    exact = True

    def marked(self, faded: float, alpha: float) -> float:
        """Return the trace plus one, minus the amount that this update itself will add."""
        return faded + (1.0 - alpha * faded)


TRACES: dict[TraceName, TraceLaw] = {"replacing": Replacing(), "accumulating": Accumulating(), "dutch": Dutch()}
