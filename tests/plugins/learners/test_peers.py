"""Nulls and peers of SARSA(lambda): what each remembers of a rollout, and what it replays."""

from __future__ import annotations

import numpy as np
import pytest

from kendama_cli.learning.learners import begin_learner
from kendama_cli.learning.state import SwingState
from kendama_cli.learning.updates import Transition
from kendama_cli.plugins.learners.bayes import BayesLearner, GaussianProcess
from kendama_cli.plugins.learners.elite import EliteLearner
from kendama_cli.plugins.learners.whole_rollouts import ReturnTable
from tests.learning.settings_files import learn_settings

RELEASED = SwingState(0.0, 0.0, 2.0, 3.0)


def swung(learner: object, rng: np.random.Generator, outcome: str, miss_m: float | None = None) -> None:
    learner.begin_rollout(rng)
    for step in range(60):
        phase = 0.3 * step
        learner.act(SwingState(0.1 * np.sin(phase), 0.0, np.sin(phase), 5.0 * np.cos(phase)), 0.05 * step)
    learner.end_rollout(outcome, RELEASED, miss_m)


def test_a_value_moves_to_the_discounted_return_that_followed_at_every_visit() -> None:
    """Returns by hand, gamma 1/2: 3 at the end, -1 + 3/2 and 2 + 1/4 before; the pair (0, 1) is visited twice."""
    table = ReturnTable(np.zeros((2, 2)), gamma=0.5, trace_decay=1.0)
    for _ in range(2):
        table.begin()
        table.update(Transition(0, 1, 2.0, 1, 0), 0.5)
        table.update(Transition(1, 0, -1.0, 0, 1), 0.5)
        assert table.update(Transition(0, 1, 3.0, None, None), 0.5) == pytest.approx(2.25 - table_before(table))
    first = 0.5 * 3.0 + 0.5 * (2.25 - 0.5 * 3.0)
    second = first + 0.5 * (3.0 - first)
    assert table.q[0, 1] == pytest.approx(second + 0.5 * (2.25 - second))
    assert table.q[1, 0] == pytest.approx(0.25 + 0.5 * (0.5 - 0.25))
    assert table.q[0, 0] == table.q[1, 1] == 0.0


def table_before(table: ReturnTable) -> float:
    """The value before the last visit's update moved it half of the way to 2.25."""
    return float(2.0 * table.q[0, 1] - 2.25)


def test_a_clone_counts_the_choices_of_successes_alone() -> None:
    learner, rng = begin_learner(learn_settings("easy", "learn/learner=clone")), np.random.default_rng(0)
    swung(learner, rng, "timeout")
    assert not learner.table.any()
    swung(learner, rng, "goal")
    counts = learner.table.copy()
    assert counts.sum() == learner.decisions
    swung(learner, rng, "missed")
    assert np.array_equal(learner.table, counts)


def test_an_elite_mutates_the_best_harmonic_and_replays_it() -> None:
    settings = learn_settings("hard", "learn/learner=elite", exploration__mutation_fraction=1.0)
    learner, rng = begin_learner(settings), np.random.default_rng(0)
    assert isinstance(learner, EliteLearner)
    swung(learner, rng, "missed", 0.1)
    first = learner.policy.array("harmonic")
    swung(learner, rng, "missed", 0.29)
    assert np.array_equal(learner.policy.array("harmonic"), first), "a worse miss does not replace a better one"
    swung(learner, rng, "goal")
    best = learner.policy.array("harmonic")
    assert not np.array_equal(best, first)
    assert best[:2] == pytest.approx(first[:2], rel=0.6)
    learner.begin_rollout(rng)
    learner.act(RELEASED, 0.0)
    assert not learner.end_rollout("goal", RELEASED).explored
    assert np.array_equal(learner.policy.array("harmonic"), best)


def test_the_gaussian_process_has_its_posterior_in_closed_form() -> None:
    rng = np.random.default_rng(3)
    points, values, asked = rng.normal(size=(8, 3)), rng.normal(size=8), rng.normal(size=(5, 3))

    def kernel(one: np.ndarray, other: np.ndarray) -> np.ndarray:
        return np.exp(-(np.linalg.norm(one[:, None] - other[None], axis=-1) ** 2) / (2 * 0.7**2))

    gained = kernel(asked, points) @ np.linalg.inv(kernel(points, points) + 0.2**2 * np.eye(8))
    mean, deviation = GaussianProcess(points, values, length=0.7, noise=0.2).posterior(asked)
    assert mean == pytest.approx(gained @ values)
    assert deviation**2 == pytest.approx(1.0 - np.sum(gained * kernel(asked, points), axis=1))


def test_bayes_replays_the_swing_that_succeeded_and_looks_on_after_a_failure() -> None:
    learner, rng = begin_learner(learn_settings("hard", "learn/learner=bayes")), np.random.default_rng(0)
    assert isinstance(learner, BayesLearner)
    for outcome in ("timeout", "timeout", "goal"):
        swung(learner, rng, outcome)
    found = np.array(learner._present)
    learner.begin_rollout(rng)
    learner.act(RELEASED, 0.0)
    assert np.array_equal(learner.policy.array("swing"), found)
    assert not learner.end_rollout("timeout", RELEASED).explored
    learner.begin_rollout(rng)
    learner.act(RELEASED, 0.0)
    assert learner.end_rollout("timeout", RELEASED).explored
