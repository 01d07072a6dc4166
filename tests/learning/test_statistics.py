"""The counting rule: what counts as learned and as solved, and after how many rollouts."""

from __future__ import annotations

from kendama_cli.learning.statistics import LearningCount
from tests.learning.settings_files import learn_settings

SETTINGS = learn_settings()


def counted(results: str) -> LearningCount:
    """The count after ``results``: g greedy success, f greedy failure, e exploring rollout."""
    count = LearningCount()
    for result in results:
        count = count.after(explored=result == "e", success=result != "f", settings=SETTINGS.count)
    return count


def test_rollouts_to_first_is_the_first_of_ten_greedy_successes_in_a_row():
    assert counted("eef" + "g" * 10).learned_at == 4
    assert not counted("eef" + "g" * 9).learned
    assert counted("gggggf" + "g" * 10).learned_at == 7


def test_exploring_rollouts_are_counted_but_neither_add_to_a_streak_nor_break_it():
    assert counted("ggggg" + "e" + "ggggg").learned_at == 1
    assert counted("e" * 20).learned_at is None
    assert counted("e" * 20).rollouts == 20


def test_exploring_rollouts_in_a_row_are_counted_up_to_the_next_greedy_one():
    assert [counted(results).explored_in_a_row for results in ("eee", "eeg", "eege")] == [3, 0, 1]


def test_the_figure_stands_whatever_comes_later():
    assert counted("f" + "g" * 10 + "fff" + "g" * 12).learned_at == 2


def test_rollouts_to_solved_are_those_before_the_first_of_eighty_greedy_successes_in_a_row():
    solved = counted("eef" + "g" * 30 + "fe" + "g" * 80)
    assert solved.rollouts_to_learned(SETTINGS.count) == 4
    assert solved.rollouts_to_solved(SETTINGS.count) == 35
    assert solved.rollouts == 115
    assert solved.solved
    assert not counted("eef" + "g" * 79).solved


def test_a_failure_counts_as_the_cap():
    assert counted("f" * 1000).rollouts_to_learned(SETTINGS.count) == 1000
    assert counted("f" * 1000).rollouts_to_solved(SETTINGS.count) == 1000


def test_learning_ends_with_the_streak_that_freezes_or_at_the_cap():
    frozen = SETTINGS.count.solved_streak
    assert not counted("g" * (frozen - 1)).finished(SETTINGS.count)
    assert counted("g" * frozen).finished(SETTINGS.count)
    assert counted("f" * 1000).finished(SETTINGS.count)
