"""Times of decisions: an action is held until the binned state changes, within a minimum and a maximum time."""

from __future__ import annotations

from kendama_cli.learning.discretisation import StateGrid
from kendama_cli.learning.settings import LearnSettings
from kendama_cli.learning.state import SwingState

NEVER_S = float("-inf")
ROUNDING_S = 1e-9
"""Slack in comparing times, so that a period that is not a binary fraction does not cost a step."""


def greedy_column(values: list[float], previous: int) -> int:
    """Return the column of the maximum value; ties keep the ``previous`` action, else the first of them."""
    best = max(values)
    return previous if values[previous] == best else values.index(best)


class HeldAction:
    """The action being held and when to look again.

    ``action`` counts the cup's accelerations; ``row`` (-1 before the first choice) and ``column`` say where the value
    of the choice stands in the table. Before the first choice the smallest acceleration counts as held.
    """

    __slots__ = (
        "_chosen_s",
        "_grid",
        "_last",
        "_longest_s",
        "_place",
        "_shortest_s",
        "action",
        "column",
        "next_look_s",
        "row",
    )

    def __init__(self, settings: LearnSettings, grid: StateGrid) -> None:
        actions = settings.actions_m_s2
        self._grid = grid
        self._last = len(actions) - 1
        self._shortest_s = settings.decision.min_s - ROUNDING_S
        self._longest_s = settings.decision.max_s - ROUNDING_S
        self._chosen_s = NEVER_S
        self._place = -1
        self.next_look_s = NEVER_S
        self.row = -1
        self.action = self.column = min(range(len(actions)), key=lambda action: abs(actions[action]))

    def due(self, state: SwingState, t_s: float) -> int | None:
        """Return the row in which to choose anew at ``t_s`` (not before ``next_look_s``), or None to hold the
        action.
        """
        place = self._grid.place(state)
        if place == self._place and t_s - self._chosen_s < self._longest_s:
            return None
        self._place = place
        return place % self._grid.n_states

    def mirrored(self, action: int) -> int:
        """Return the column of ``action`` in the row that is due, or the action of a column: they mirror each other."""
        return self._last - action if self._place >= self._grid.n_states else action

    def hold(self, row: int, action: int, t_s: float) -> None:
        """Hold ``action``, chosen in ``row`` at ``t_s``."""
        self.row = row
        self.action = action
        self.column = self.mirrored(action)
        self._chosen_s = t_s
        self.next_look_s = t_s + self._shortest_s


class BinActor:
    """Actor that decides anew where ``learn.decision`` and the bins of ``learn.grid`` ask for it, and holds till then.

    ``decisions`` counts those of the rollout.
    """

    decides_on_bins = True

    def __init__(self, settings: LearnSettings) -> None:
        self._settings, self._grid = settings, StateGrid(settings.grid)
        self._let_go()

    def _let_go(self) -> None:
        """Forget what is held; the next call of ``act`` decides at once."""
        self._held = HeldAction(self._settings, self._grid)
        self._acceleration_m_s2 = 0.0
        self.decisions = 0

    @property
    def next_look_s(self) -> float:
        """``act`` changes nothing before this time into the rollout, so no reading is needed before it [s]."""
        return self._held.next_look_s

    def act(self, state: SwingState, t_s: float) -> float:
        """Return the cup's acceleration [m/s^2] at ``t_s`` into the rollout."""
        held = self._held
        if t_s >= held.next_look_s:
            row = held.due(state, t_s)
            if row is not None:
                self._acceleration_m_s2 = self._decide(held, row, state, t_s)
                self.decisions += 1
        return self._acceleration_m_s2

    def _decide(self, held: HeldAction, row: int, state: SwingState, t_s: float) -> float:
        """Let ``held`` hold an action; return the cup's acceleration [m/s^2] until the next decision."""
        raise NotImplementedError
