"""Acting by a finished table, and what a table must have been learned with to be acted by."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping

from kendama_cli.artifacts.policy import PolicyArtifact
from kendama_cli.learning.decision import BinActor, HeldAction, greedy_column
from kendama_cli.learning.discretisation import StateGrid
from kendama_cli.learning.settings import LearnSettings
from kendama_cli.learning.state import SwingState
from kendama_cli.schema.arrays import Array


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
    wanted = StateGrid(settings.grid).n_states, len(settings.actions_m_s2)
    if q.shape != wanted:
        raise ValueError(f"the table has shape {q.shape}; the configuration 'learn' needs {wanted}")
    return q
