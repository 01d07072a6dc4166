"""Times of decisions (an action is held until the binned state changes, within two times), and a finished table."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping

from kendama_cli.artifacts.policy import PolicyArtifact
from kendama_cli.learning.discretisation import StateGrid
from kendama_cli.learning.settings import LearnSettings
from kendama_cli.learning.state import SwingState
from kendama_cli.schema.arrays import Array

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
        position = self._grid.place(state)
        if position == self._place and t_s - self._chosen_s < self._longest_s:
            return None
        self._place = position
        return position % self._grid.n_states

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


def task_meaning(settings: LearnSettings) -> Mapping[str, object]:
    """Return the settings that give a policy on bins its meaning: the task with its goal, bins, actions, decisions."""
    parts = {name: dataclasses.asdict(getattr(settings, name)) for name in ("grid", "decision", "goal")}
    return {**parts, "task": settings.task, "actions_m_s2": settings.actions_m_s2}


def seal_table(q: Array, settings: LearnSettings, meaning: Mapping[str, object] | None = None) -> PolicyArtifact:
    """Return the policy of the values ``q`` (rows, actions), of the learner that ``settings`` choose.

    Where the rows are not the states of ``learn.grid``, ``meaning`` says more than ``task_meaning``.
    """
    return PolicyArtifact.seal(settings.learner.kind, meaning or task_meaning(settings), {"q": q})


class GreedyPolicy(BinActor):
    """Policy of the best action of a frozen table, at the times at which it was learned to be chosen."""

    def __init__(self, policy: PolicyArtifact, settings: LearnSettings) -> None:
        """Check that the table has the shape that the settings need; raises ValueError if not."""
        super().__init__(settings)
        self.table = checked_table(policy.array("q"), settings)
        self._values = self.table.tolist()

    def begin_rollout(self) -> None:
        """Forget the last action; the next call of ``act`` chooses at once."""
        self._let_go()

    def _decide(self, held: HeldAction, row: int, state: SwingState, t_s: float) -> float:
        column = greedy_column(self._values[row], held.mirrored(held.action))
        held.hold(row, held.mirrored(column), t_s)
        return self._settings.actions_m_s2[held.action]


def checked_table(q: Array, settings: LearnSettings) -> Array:
    """Return ``q``; raises ValueError if its shape is not (states, actions) of ``settings``."""
    desired = StateGrid(settings.grid).n_states, len(settings.actions_m_s2)
    if q.shape != desired:
        raise ValueError(f"the table has shape {q.shape}; the configuration 'learn' needs {desired}")
    return q
