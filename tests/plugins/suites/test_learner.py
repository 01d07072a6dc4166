"""Every learner keeps the laws of its interface, and the laws notice one that does not."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import Any

import numpy as np
import pytest

from kendama_cli.learning.decision import GreedyPolicy
from kendama_cli.learning.interface import FinishedRollout, LearnerMaker
from kendama_cli.learning.sarsa import SARSA, SarsaLearner
from kendama_cli.learning.settings import LEARNERS, LearnSettings
from kendama_cli.learning.state import SwingState
from kendama_cli.plugins.suites import learner as conformance
from tests.learning.settings_files import learn_settings

OURS = (
    "bayes",
    "clone",
    "elite",
    "monte_carlo",
    "agent",
    "sarsa",
    "random_replay",
    "random",
    "energy_pumping",
    "open_loop",
    "dyna",
    "tile_coding",
    "model_based",
)


@pytest.mark.parametrize("check", conformance.CHECKS)
@pytest.mark.parametrize("task", ["easy", "paper_caught"])
@pytest.mark.parametrize("kind", ["sarsa", "epsilon_greedy", "random_replay", "random", "energy_pumping", "cma"])
def test_every_learner_keeps_every_law(kind, task, check):
    check(learn_settings(task, f"learn/learner={kind}"))


@pytest.mark.parametrize("check", conformance.CHECKS)
@pytest.mark.parametrize("kind", ["dyna", "tile_coding", "monte_carlo", "clone", "elite", "bayes"])
def test_every_learner_of_the_part_keeps_every_law(kind, check):
    check(learn_settings("paper_caught", f"learn/learner={kind}"))


@pytest.mark.parametrize("check", conformance.CHECKS)
def test_the_model_based_learner_keeps_every_law(check):
    short = {"learner__models": 2, "learner__candidates": 2, "learner__population": 4, "learner__generations": 1}
    check(learn_settings("paper_caught", "learn/learner=model_based", **short))


@pytest.mark.parametrize("check", conformance.CHECKS)
def test_q_learning_keeps_every_law(check):
    check(learn_settings("easy", "learn/learner=epsilon_greedy", update="q"))


def test_the_learners_are_found_by_their_entry_points():
    assert set(OURS) <= set(LEARNERS.kinds())
    for kind in OURS:
        assert isinstance(LEARNERS.maker(kind), LearnerMaker)


class _Drawing(SarsaLearner):
    """Acts by random numbers of its own."""

    _own = np.random.default_rng(7)

    def act(self, state: SwingState, t_s: float) -> float:
        return float(self._own.uniform(-8.0, 8.0))


class _Restless(SarsaLearner):
    """Changes its answer before it said it would."""

    def act(self, state: SwingState, t_s: float) -> float:
        return super().act(state, t_s) + 1e-9 * t_s


class _TooStrong(SarsaLearner):
    def act(self, state: SwingState, t_s: float) -> float:
        return 1.01 * super().act(state, t_s)


class _Forgetful(SarsaLearner):
    """Saves its table rounded."""

    def state(self) -> dict[str, Any]:
        return {**super().state(), "q": self.table.astype(np.float32).astype(np.float64)}


class _Generous(SarsaLearner):
    """Counts every rollout as a success."""

    def end_rollout(self, outcome: Any, state: SwingState, miss_m: float | None = None) -> FinishedRollout:
        return super().end_rollout("goal", state)


class _NeverFrozen(SarsaLearner):
    """Goes on learning while it is validated."""

    def end_rollout(self, outcome: Any, state: SwingState, miss_m: float | None = None) -> FinishedRollout:
        self._alpha = 0.5
        return super().end_rollout(outcome, state)


@pytest.mark.parametrize(
    ("wrong", "check", "words"),
    [
        (_Drawing, conformance.check_determinism, "the same seed and readings give the same actions"),
        (_Restless, conformance.check_holding, "before next_look_s the action stays what it is"),
        (_TooStrong, conformance.check_actions, r"an action lies within -8.0 and 8.0"),
        (_Forgetful, conformance.check_checkpoint, "the policy is saved bit for bit"),
        (_Generous, conformance.check_count, "a rollout that reached the goal is a success"),
        (_NeverFrozen, conformance.check_freezing, "frozen, nothing is learned"),
    ],
)
def test_the_laws_notice_a_learner_that_breaks_them(monkeypatch, wrong, check, words):
    def resume(settings: LearnSettings, state: Mapping[str, Any]) -> SarsaLearner:
        return wrong.from_state(settings, state)

    broken = dataclasses.replace(SARSA, begin=lambda settings, policy: wrong(settings), resume=resume)
    monkeypatch.setattr(type(LEARNERS), "maker", lambda registry, kind: broken)
    with pytest.raises(AssertionError, match=words):
        check(learn_settings())


def test_the_laws_notice_a_policy_that_remembers_the_last_rollout(monkeypatch):
    class Remembering(GreedyPolicy):
        rollouts = 0

        def begin_rollout(self) -> None:
            super().begin_rollout()
            self.rollouts += 1

        def act(self, state: SwingState, t_s: float) -> float:
            return super().act(state, t_s) * (0.9 if self.rollouts > 1 else 1.0)

    broken = dataclasses.replace(SARSA, policy=Remembering)
    monkeypatch.setattr(type(LEARNERS), "maker", lambda registry, kind: broken)
    with pytest.raises(AssertionError, match="in every rollout of a policy"):
        conformance.check_policy(learn_settings())
