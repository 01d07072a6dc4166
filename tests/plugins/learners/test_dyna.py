"""Dyna: what a model of the robot's own transitions adds to a table, and that it adds nothing where it is not asked."""

from __future__ import annotations

import numpy as np
import pytest

from kendama_cli.learning.learners import begin_learner
from kendama_cli.learning.sarsa import ValueTable
from kendama_cli.learning.state import SwingState
from kendama_cli.learning.updates import Transition
from kendama_cli.plugins.learners.dyna import TransitionModel
from tests.learning.settings_files import learn_settings

CHAIN = [Transition(row, 0, 0.0, row + 1, 0) for row in range(5)] + [Transition(5, 0, 1.0, None, None)]


def swung(kind: str, **replaced: object) -> np.ndarray:
    """The table after three rollouts with a ball that swings, the second of which succeeds."""
    learner = begin_learner(learn_settings("easy", f"learn/learner={kind}", **replaced))
    rng = np.random.default_rng(0)
    for outcome in ("timeout", "goal", "timeout"):
        learner.begin_rollout(rng)
        for step in range(60):
            phase = 0.3 * step
            learner.act(SwingState(0.1 * np.sin(phase), 0.0, np.sin(phase), 5.0 * np.cos(phase)), 0.05 * step)
        learner.end_rollout(outcome, SwingState(0.0, 0.0, 2.0, 3.0))
    assert learner.table is not None
    return np.asarray(learner.table)


def test_without_planning_it_is_sarsa_bit_for_bit():
    assert np.array_equal(swung("dyna", learner__planning=0), swung("sarsa"))
    assert not np.array_equal(swung("dyna"), swung("sarsa"))


@pytest.mark.parametrize("backup", ["q", "sarsa"])
def test_imagined_transitions_carry_a_reward_back_that_was_met_once(backup):
    table, model = ValueTable(np.zeros((6, 2)), gamma=0.9, trace_decay=0.0), TransitionModel(6, 2, 4)
    for transition in CHAIN:
        table.update(transition, 1.0)
        model.add(transition)
    assert np.count_nonzero(table.q) == 1  # one step at a time, only the last choice has learned
    for imagined in model.imagined(200, np.random.default_rng(0)):
        table.back_up(imagined, 1.0, backup)
    assert table.q[:, 0] == pytest.approx(0.9 ** np.arange(5, -1, -1))


def test_what_is_imagined_follows_as_often_as_it_did_and_the_oldest_is_forgotten():
    model = TransitionModel(2, 1, 4)
    for led_to in (0, 0, 0, 1, 1, 1):
        model.add(Transition(0, 0, 1.0, led_to, 0))
    rows = [imagined.next_row for imagined in model.imagined(4000, np.random.default_rng(1))]
    assert np.mean(rows) == pytest.approx(0.75, abs=0.03)  # 4 sigma: 0.027


def test_backing_up_leaves_the_traces_of_the_rollout_alone():
    tables = [ValueTable(np.zeros((3, 1)), gamma=1.0, trace_decay=1.0) for _ in range(2)]
    for number, table in enumerate(tables):
        table.update(Transition(0, 0, 0.0, 1, 0), 1.0)
        if number:
            table.back_up(Transition(2, 0, 0.0, 2, 0), 1.0, "q")
        table.update(Transition(1, 0, 1.0, None, None), 1.0)
    assert np.array_equal(tables[0].q, tables[1].q)
    assert tables[0].q[0, 0] == 1.0
