"""Between two rollouts: what counts as learned on the hardware, and a checkpoint that loses nothing."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from kendama_cli.learning.decision import seal_table
from kendama_cli.learning.state import SwingState
from kendama_cli.stages.transfer.progress import STARTS, Progress, Start
from tests.control.test_games import LEARN, TRANSFER

REST = SwingState(0.0, 0.0, 0.0, 0.0)
TABLE = np.random.default_rng(0).normal(size=(324, 5))
POLICY = seal_table(TABLE, LEARN)
FREEZING = dataclasses.replace(TRANSFER, solved_streak=14, max_rollouts=40)


def begun() -> Progress:
    return Progress.resumed(None, POLICY, LEARN, FREEZING, np.random.default_rng(1))


def succeed(progress: Progress, start: Start, times: int = 1, *, outcome: str = "goal") -> None:
    for _ in range(times):
        learner = progress.learner(start)
        learner.begin_rollout(np.random.default_rng(2))
        learner.act(REST, 0.0)
        learner.end_rollout("goal" if outcome == "goal" else "timeout", REST)
        progress.keep(learner, start)


def test_the_streak_counts_but_the_table_is_frozen_only_after_a_longer_one() -> None:
    progress = begun()
    succeed(progress, "table", outcome="timeout")
    while not progress.learned("table"):
        succeed(progress, "table")
    needed = progress.rollouts("table")
    assert not progress.frozen("table")
    succeed(progress, "table", 3)
    assert not progress.frozen("table")
    succeed(progress, "table")
    assert progress.frozen("table")
    assert progress.rollouts("table") == needed
    assert needed >= 2, "the failure counts"


def test_a_table_that_fits_at_once_needs_one_rollout() -> None:
    progress = begun()
    succeed(progress, "table", 14)
    assert progress.rollouts("table") == 1


def test_from_scratch_nothing_more_is_wanted_than_the_streak_that_counts() -> None:
    progress = begun()
    while not progress.learned("scratch"):
        succeed(progress, "scratch")
    assert progress.frozen("scratch")
    assert progress.learner("table").count.rollouts == 0


@pytest.mark.parametrize("start", ["table", "scratch"])
def test_learning_ends_at_the_cap_which_then_is_the_figure(start: Start) -> None:
    progress = begun()
    succeed(progress, start, FREEZING.max_rollouts, outcome="timeout")
    assert progress.frozen(start)
    assert not progress.learned(start)
    assert progress.rollouts(start) == FREEZING.max_rollouts


def test_a_shorter_streak_than_the_counting_rules_cannot_be_asked_for() -> None:
    progress = Progress.resumed(
        None, POLICY, LEARN, dataclasses.replace(FREEZING, solved_streak=1), np.random.default_rng(1)
    )
    succeed(progress, "table", LEARN.count.learned_streak - 1)
    assert not progress.frozen("table")
    succeed(progress, "table")
    assert progress.frozen("table")


def test_what_is_saved_is_all_there_is() -> None:
    progress = begun()
    succeed(progress, "table", 3)
    succeed(progress, "scratch", 2)
    progress.before.append(True)
    progress.finished(1.5, 2)
    again = Progress.resumed(progress.saved(), POLICY, LEARN, FREEZING, np.random.default_rng(99))
    for start in STARTS:
        one, other = (each.learner(start).state() for each in (progress, again))
        for table in ("q", "best"):
            assert np.array_equal(one.pop(table), other.pop(table))
        assert one == other
    assert again.count == progress.count == 6
    assert again.clock_s == 1.5
    assert again.rng("learn", 4).integers(2**63) == progress.rng("learn", 4).integers(2**63)


def test_the_empty_table_is_empty_and_the_other_as_handed_over() -> None:
    progress = begun()
    assert np.array_equal(progress.learner("table").table, TABLE)
    assert np.unique(progress.learner("scratch").table).tolist() == [LEARN.initial_q]
