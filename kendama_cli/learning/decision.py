"""When to decide: an action is held until the binned state changes, within a shortest and a longest time."""

from __future__ import annotations

from kendama_cli.settings.learn import DecisionSettings

NEVER_S = float("-inf")
ROUNDING_S = 1e-9
"""Slack in comparing times, so that a period that is not a binary fraction does not cost a step."""


def resting_column(actions_m_s2: tuple[float, ...]) -> int:
    """The column of the smallest acceleration: what counts as the action before the first."""
    return min(range(len(actions_m_s2)), key=lambda column: abs(actions_m_s2[column]))


def greedy_column(values: list[float], previous: int) -> int:
    """The column of the largest value; ties keep the ``previous`` action, else the first of them."""
    best = max(values)
    return previous if values[previous] == best else values.index(best)


class HeldAction:
    """The action being held: its state's ``row`` (-1 before the first), its ``column``, and when to look again."""

    __slots__ = ("_chosen_s", "_longest_s", "_shortest_s", "column", "next_look_s", "row")

    def __init__(self, settings: DecisionSettings, column: int) -> None:
        self._shortest_s = settings.shortest_s - ROUNDING_S
        self._longest_s = settings.longest_s - ROUNDING_S
        self._chosen_s = NEVER_S
        self.row = -1
        self.column = column
        self.next_look_s = NEVER_S

    def due(self, row: int, t_s: float) -> bool:
        """Whether a new action must be chosen in state ``row`` at ``t_s`` (not before ``next_look_s``)."""
        return row != self.row or t_s - self._chosen_s >= self._longest_s

    def hold(self, row: int, column: int, t_s: float) -> None:
        """Hold ``column``, chosen in ``row`` at ``t_s``."""
        self.row = row
        self.column = column
        self._chosen_s = t_s
        self.next_look_s = t_s + self._shortest_s
