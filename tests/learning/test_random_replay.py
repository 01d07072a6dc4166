"""The null models: they do what an exploring rollout of a table does, and keep the harmonic that succeeded, or none."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from kendama_cli.errors import ConfigError
from kendama_cli.learning.learners import begin_learner
from kendama_cli.learning.random_replay import RandomReplayLearner
from kendama_cli.learning.sarsa import SarsaLearner
from kendama_cli.learning.state import SwingState
from kendama_cli.simulation.swingup.environment import SwingUpEnvironment
from tests.learning.settings_files import game_settings, learn_settings

SEARCH = learn_settings("easy", "learn/learner=random_replay")
LAST = SwingState(0.1, 0.0, 2.0, 3.0)


def searching(name: str) -> RandomReplayLearner:
    return RandomReplayLearner(learn_settings(name, "learn/learner=random_replay"))


def play(learner: RandomReplayLearner, results: str, rng: np.random.Generator) -> list[tuple[bool, list[float]]]:
    """Rollouts that end with success (g) or failure (f): whether each explored, and its harmonic."""
    seen = []
    for result in results:
        learner.begin_rollout(rng)
        learner.act(SwingState(0.0, 0.0, 0.0, 0.0), 0.0)
        finished = learner.end_rollout("goal" if result == "g" else "timeout", LAST)
        seen.append((finished.explored, list(learner._present)))
    return seen


@pytest.mark.parametrize("name", ["easy", "hard", "paper_caught"])
def test_its_first_rollout_is_the_first_exploring_one_of_a_table(name):
    """What a table learner owes to its table is all that sets the two apart."""
    search, table = searching(name), SarsaLearner(learn_settings(name))
    rollouts = []
    for learner in (search, table):
        environment = SwingUpEnvironment(learn_settings(name), game_settings())
        learner.begin_rollout(np.random.default_rng(3))
        rollout = environment.roll_out(learner, environment.noise(np.random.default_rng(4)))
        rollouts.append((rollout, learner.end_rollout(rollout.outcome, rollout.final)))
    assert rollouts[0] == rollouts[1]
    assert rollouts[0][0].half_swings > 0


def test_it_draws_until_a_success_and_then_replays_that_one():
    seen = play(RandomReplayLearner(SEARCH), "fffggg", np.random.default_rng(0))
    explored, harmonics = zip(*seen, strict=True)
    assert explored == (True, True, True, True, False, False)
    assert len({tuple(harmonic) for harmonic in harmonics[:4]}) == 4
    assert harmonics[4] == harmonics[5] == harmonics[3]


def test_after_a_failed_replay_it_draws_anew_and_keeps_what_succeeds():
    learner = RandomReplayLearner(SEARCH)
    seen = play(learner, "gf" + "f" + "f" + "g" + "g", np.random.default_rng(0))
    assert [explored for explored, _ in seen] == [True, False, True, False, True, False]
    first, other = seen[0][1], seen[4][1]
    assert seen[3][1] == first, "what was drawn after the failure failed too: the old one is replayed again"
    assert other != first
    assert learner.policy.array("harmonic").tolist() == other


def test_with_no_chance_of_drawing_anew_it_keeps_to_its_first_success():
    keeping = dataclasses.replace(
        SEARCH,
        learner=dataclasses.replace(SEARCH.learner, after_failure=0.0),
    )
    seen = play(RandomReplayLearner(keeping), "gffffg", np.random.default_rng(0))
    assert [explored for explored, _ in seen] == [True] + [False] * 5


def test_the_policy_is_the_harmonic_with_the_longest_streak_while_it_was_frozen():
    learner, rng = RandomReplayLearner(SEARCH), np.random.default_rng(0)
    first = play(learner, "g" + "g" * 15, rng)[0][1]
    play(learner, "f" + "g" + "g" * 3, rng)
    assert learner.policy.array("harmonic").tolist() == first
    second = play(learner, "f" + "g" + "g" * 16, rng)[1][1]
    assert second != first
    assert learner.policy.array("harmonic").tolist() == second


def test_before_anything_was_drawn_its_policy_leaves_the_cup_where_it_is():
    learner = begin_learner(SEARCH)
    assert learner.policy.array("harmonic").tolist() == [0.0, 0.0, 0.0]
    assert learner.table is None


def test_wrong_settings_are_refused_in_one_line():
    with pytest.raises(ConfigError, match=r"'learn.learner.after_failure' is 2.0; allowed"):
        learn_settings("easy", "learn/learner=random_replay", learner__after_failure=2.0)
    with pytest.raises(ConfigError, match=r"'learn.learner.kind' is 'sarssa', did you mean 'learn.learner.kind=sarsa'"):
        learn_settings("easy", learner__kind="sarssa")


def test_chance_itself_keeps_nothing_and_every_rollout_of_it_counts():
    learner = begin_learner(learn_settings("easy", "learn/learner=random"))
    rng, harmonics = np.random.default_rng(0), []
    for result in "fgfgg":
        learner.begin_rollout(rng)
        finished = learner.end_rollout("goal" if result == "g" else "timeout", LAST)
        assert not finished.explored
        harmonics.append(tuple(learner.policy.array("harmonic").tolist()))
    assert len(set(harmonics)) == 5
    assert learner.count.streak == 2
