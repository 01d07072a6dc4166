"""Acting by a finished table, and what a table must have been learned with to be acted by."""

from __future__ import annotations

import dataclasses
import json

import numpy as np

from kendama_cli.artifacts.policy import Policy
from kendama_cli.learning.decision import HeldAction, greedy_column
from kendama_cli.learning.discretisation import StateGrid
from kendama_cli.learning.settings import LearnSettings
from kendama_cli.learning.state import SwingState


def learning_json(settings: LearnSettings) -> str:
    """The settings that give a table its meaning (bins, actions, decisions, goal) as canonical JSON."""
    meaning = {name: getattr(settings, name) for name in ("grid", "decision", "goal")}
    plain: dict[str, object] = {name: dataclasses.asdict(part) for name, part in meaning.items()}
    plain["actions_m_s2"] = settings.actions_m_s2
    return json.dumps(plain, sort_keys=True, separators=(",", ":"))


class GreedyPolicy:
    """Chooses the best action of a frozen table, at the times at which it was learned to be chosen."""

    def __init__(self, policy: Policy, settings: LearnSettings) -> None:
        self._grid = StateGrid(settings.grid)
        wanted = (self._grid.n_states, len(settings.actions_m_s2))
        if policy.q.shape != wanted:
            raise ValueError(f"the table has shape {policy.q.shape}; the settings need {wanted}")
        self._table = np.asarray(policy.q).tolist()
        self._settings = settings
        self.begin_rollout()

    def begin_rollout(self) -> None:
        """Forget the last action; the next call of ``act`` chooses at once."""
        self._held = HeldAction(self._settings, self._grid)

    decides_on_bins = True

    @property
    def next_look_s(self) -> float:
        """``act`` changes nothing before this time into the rollout, so no reading is needed before it [s]."""
        return self._held.next_look_s

    def act(self, state: SwingState, t_s: float) -> float:
        """The cup's acceleration [m/s^2] at ``t_s`` into the rollout."""
        held = self._held
        if t_s >= held.next_look_s:
            row = held.due(state, t_s)
            if row is not None:
                column = greedy_column(self._table[row], held.mirrored(held.action))
                held.hold(row, held.mirrored(column), t_s)
        return self._settings.actions_m_s2[held.action]
