"""The open loop: it learns a swing that lasts where its null model does not, and looks at no ball."""

from __future__ import annotations

import numpy as np
import pytest

from kendama_cli.errors import ConfigError
from kendama_cli.learning.learners import begin_learner, make_policy
from kendama_cli.learning.state import SwingState
from kendama_cli.plugins.learners.open_loop import OpenLoopLearner
from kendama_cli.simulation.swingup.environment import SwingUpEnvironment
from tests.learning.settings_files import game_settings, learn_settings

REST = SwingState(0.0, 0.0, 0.0, 0.0)


def ended(learner: OpenLoopLearner, results: str, rng: np.random.Generator) -> list[bool]:
    """Rollouts that end with success (g) or failure (f): whether each explored."""
    explored = []
    for result in results:
        learner.begin_rollout(rng)
        learner.act(REST, 0.0)
        explored.append(learner.end_rollout("goal" if result == "g" else "timeout", REST).explored)
    return explored


def test_it_learns_a_swing_that_succeeds_eighty_times_in_a_row():
    settings = learn_settings("paper_caught", "learn/learner=cma")
    environment = SwingUpEnvironment(settings, game_settings())
    learner, rng = begin_learner(settings), np.random.default_rng(10500)
    while not learner.count.finished(settings.count):
        learner.begin_rollout(rng)
        rollout = environment.roll_out(learner, environment.noise(rng))
        learner.end_rollout(rollout.outcome, rollout.final, None if rollout.catch is None else rollout.catch.miss_m)
    assert learner.count.solved
    policy = make_policy(learner.policy, settings)
    caught = 0
    for _ in range(50):
        policy.begin_rollout()
        caught += environment.roll_out(policy, environment.noise(rng)).success
    assert caught >= 45


def test_the_balls_readings_change_nothing():
    settings = learn_settings("hard", "learn/learner=cma")
    policy = make_policy(begin_learner(settings).policy, settings)
    answers = []
    for angle, rate in ((0.0, 0.0), (2.0, -6.0)):
        policy.begin_rollout()
        answers.append([policy.act(SwingState(0.0, 0.0, angle, rate), 0.05 * step) for step in range(20)])
    assert answers[0] == answers[1]
    assert min(answers[0]) < 0.0 < max(answers[0])


def test_a_good_generation_is_followed_by_replays_until_one_fails():
    learner = OpenLoopLearner(learn_settings("hard", "learn/learner=cma", learner__generation=4))
    seen = ended(learner, "fffg" + "fggf" + "ggf" + "f", np.random.default_rng(0))
    assert seen == [True] * 8 + [False] * 3 + [True]


def test_generations_without_a_success_begin_the_search_anew():
    learner = OpenLoopLearner(learn_settings("hard", "learn/learner=cma", learner__generation=4))
    rng = np.random.default_rng(0)
    ended(learner, "f" * 15, rng)
    assert [len(one) for one in learner.state()["costs"]] == [4, 4, 4, 3]
    ended(learner, "f", rng)
    assert learner.state()["costs"] == [[]]


def test_a_range_the_wrong_way_round_is_refused_in_one_line():
    with pytest.raises(ConfigError, match=r"'learn.learner.amplitude' is \[1.5, 0.9\]; allowed: \[low, high\]"):
        learn_settings("hard", "learn/learner=cma", learner__amplitude=[1.5, 0.9])
