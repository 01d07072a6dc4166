"""Actions while values are learned."""

from __future__ import annotations

import numpy as np
import pytest

from kendama_cli.learning.sarsa import SarsaLearner
from kendama_cli.learning.state import SwingState
from kendama_cli.learning.statistics import LearningCount
from kendama_cli.learning.value_learner import Acting
from tests.learning.settings_files import learn_settings

STREAK = 3


def after(acting: Acting, value: float, before: LearningCount, *, streak: int, failed: bool = False) -> LearningCount:
    """A rollout after which every value is ``value``."""
    count = LearningCount(streak=streak, greedy_failed=failed)
    acting.ended(np.array([[value]]), before, count, learned=before.streak < STREAK, streak=STREAK)
    return count


def by(acting: Acting, latest: float) -> float:
    return float(acting.by(np.array([[latest]]))[0, 0])


def test_successes_in_a_row_are_acted_on_by_their_mean_and_a_failure_ends_it() -> None:
    acting = Acting(np.zeros((1, 1)), averaged=True)
    count = after(acting, 1.0, LearningCount(), streak=0)
    assert by(acting, 1.0) == 1.0
    for streak, value, mean in ((1, 2.0, 2.0), (2, 4.0, 3.0), (3, 9.0, 5.0)):
        count = after(acting, value, count, streak=streak)
        assert by(acting, value) == pytest.approx(mean)
    count = after(acting, 9.0, count, streak=4)
    assert by(acting, 9.0) == pytest.approx(5.0)
    failed = after(acting, 9.0, count, streak=0, failed=True)
    assert by(acting, 9.0) == pytest.approx(5.0)
    after(acting, 7.0, failed, streak=0, failed=True)
    assert by(acting, 7.0) == 7.0


@pytest.mark.parametrize(("averaged", "kept"), [(True, 5.0), (False, 9.0)])
def test_what_had_the_longest_streak_while_frozen_is_handed_over(averaged: bool, kept: float) -> None:
    acting = Acting(np.zeros((1, 1)), averaged=averaged)
    count = LearningCount()
    for streak, value in ((1, 2.0), (2, 4.0), (3, 9.0), (4, 9.0)):
        count = after(acting, value, count, streak=streak)
    count = after(acting, 9.0, count, streak=0, failed=True)
    count = after(acting, 1.0, count, streak=0, failed=True)
    saved = Acting(np.zeros((1, 1)), averaged=averaged)
    saved.restore(acting.state())
    for one in (acting, saved):
        assert float(one.handed_over(np.array([[1.0]]), count)[0, 0]) == pytest.approx(kept)
        assert by(one, 1.0) == 1.0


@pytest.mark.parametrize("acting", ["latest", "streak_mean"])
def test_a_learner_hands_over_what_its_setting_says(acting: str) -> None:
    learner = SarsaLearner(learn_settings("paper_caught", acting=acting))
    tables = []
    for seed in range(5):
        learner.begin_rollout(np.random.default_rng(seed))
        explored = learner.explored
        for step in range(200):
            learner.act(SwingState(0.0, 0.0, 0.3 * np.sin(0.05 * step * (seed + 1)), 2.0), 0.02 * step)
        learner.end_rollout("goal", SwingState(0.0, 0.0, 2.0, 2.0))
        if not explored:
            tables.append(learner.table)
    assert len(tables) == 4
    assert np.ptp(tables, axis=0).max() > 0.0
    expected = tables[-1] if acting == "latest" else np.mean(tables, axis=0)
    np.testing.assert_allclose(learner.policy.array("q"), expected, rtol=0, atol=1e-12)


def test_the_step_size_fades_with_the_rollouts_and_is_zero_while_frozen() -> None:
    learner = SarsaLearner(learn_settings(alpha=0.5, alpha_decay_rollouts=10))
    steps = []
    for outcome in ["timeout", "goal", *["goal"] * 10, "timeout", "goal"]:
        learner.begin_rollout(np.random.default_rng(0))
        steps.append(learner._alpha)
        learner.act(SwingState(0.0, 0.0, 0.0, 0.0), 0.0)
        learner.end_rollout(outcome, SwingState(0.0, 0.0, 0.0, 0.0))  # type: ignore[arg-type]
    # the first two explore, ten successes freeze the table, a failure goes on with it
    assert steps == pytest.approx([*(0.5 / (1 + k / 10) for k in range(12)), 0.0, 0.5 / 2.3])
