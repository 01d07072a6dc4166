"""Updates of a table of values: the target that the value of a choice moves to (``learn.update``).

Either moves Q(s, a) toward r + gamma V, and they differ in V alone (Sutton and Barto, 2nd edition, chapter 6):

    sarsa   V = Q(s', a')          the action chosen there
    q       V = max_b Q(s', b)     Watkins: traces end where the choice is not the best
"""

from __future__ import annotations

from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

UpdateName = Literal["sarsa", "q"]


class Transition(NamedTuple):
    """One choice and its result; ``next_row`` and ``next_column`` are None where the rollout ended."""

    row: int
    column: int
    reward: float
    next_row: int | None
    next_column: int | None


def ahead(update: UpdateName, q: NDArray[np.float64], row: int, column: int) -> float:
    """Return V from the table ``q`` for a transition that led to ``row``, where ``column`` was chosen."""
    return float(q[row, column] if update == "sarsa" else q[row].max())


def keeps_traces(update: UpdateName, q: NDArray[np.float64], row: int, column: int) -> bool:
    """Return True if earlier choices have a part in the value after this transition: for ``q`` greedy ones alone."""
    return update == "sarsa" or bool(q[row, column] == q[row].max())
