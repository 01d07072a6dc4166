"""Learners of ours in environments of others: any Box and Discrete, and a gain that feedback earns."""

from __future__ import annotations

import dataclasses
import json
import subprocess
import sys
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium import spaces

import kendama_cli
from kendama_cli.api import configuration
from kendama_cli.cli.main import main
from kendama_cli.errors import ConfigError, StageError
from kendama_cli.learning.sarsa import ValueTable
from kendama_cli.learning.updates import Transition
from kendama_cli.plugins.bench.learn_on import learn_on
from kendama_cli.plugins.bench.learner import Harmonics, TabularLearner
from kendama_cli.plugins.bench.tiles import Levels, TileTable, Tiling, bounds, widened


class Homing(gymnasium.Env[Any, Any]):
    """A point on a line that is to go home from either side: what no action planned ahead can do."""

    observation_space = spaces.Box(-np.inf, np.inf, (1,))
    action_space = spaces.Box(-1.0, 1.0, (1,))

    def reset(self, *, seed: int | None = None, options: Any = None) -> tuple[Any, dict[str, Any]]:
        super().reset(seed=seed)
        self.x = float(self.np_random.choice([-1.0, 1.0]))
        return np.array([self.x]), {}

    def step(self, action: Any) -> tuple[Any, float, bool, bool, dict[str, Any]]:
        self.x += 0.2 * float(action[0])
        return np.array([self.x]), -abs(self.x), False, False, {}


SHORT = ["bench.max_steps=20", "bench.episodes=200", "bench.evaluation_episodes=30", "bench.ranging_episodes=5"]


def test_a_table_gains_where_feedback_is_needed_and_never_ends_the_value_where_time_ends_an_episode():
    learned = learn_on(Homing(), overrides=SHORT, seed=3)
    best = -sum(max(0.0, 1.0 - 0.2 * k) for k in range(1, 21))
    assert learned.metrics["frozen_return"] > 0.6 * learned.metrics["replayed_return"]  # both negative
    assert learned.metrics["frozen_return"] == pytest.approx(best, abs=1.5)
    assert learned.policy.low[0] < -1.0 < 1.0 < learned.policy.high[0]


def test_the_package_has_the_function_that_the_part_adds():
    assert kendama_cli.learn_on is learn_on
    with pytest.raises(AttributeError, match="no attribute 'learn_off'"):
        kendama_cli.learn_off  # noqa: B018


def test_the_same_seed_learns_the_same_and_another_not():
    one, again, other = (learn_on(Homing(), overrides=SHORT, seed=seed) for seed in (1, 1, 2))
    assert np.array_equal(one.policy.values, again.policy.values)
    assert one.metrics == again.metrics
    assert not np.array_equal(one.policy.values, other.policy.values)


@pytest.mark.parametrize("update", ["sarsa", "q"])
def test_on_one_tiling_it_is_the_table_of_learn(update):
    mine = TileTable(3, gamma=0.9, trace_decay=0.8, update=update)
    theirs = ValueTable(np.zeros((4, 3)), gamma=0.9, trace_decay=0.8, update="sarsa")
    rng = np.random.default_rng(0)
    row, column = 0, 1
    for step in range(200):
        there, then = int(rng.integers(4)), int(rng.integers(3))
        if update == "q":  # where each choice is the best, Watkins' target is SARSA's, and no trace ends
            then = int(np.argmax(theirs.q[there]))
        reward, over = float(rng.normal()), step % 40 == 39
        following = None if over else (mine.values(np.array([there])), then)
        mine.update(np.array([row]), column, reward, following, 0.3)
        theirs.update(Transition(row, column, reward, None if over else there, None if over else then), 0.3)
        row, column = there, then
        if over:
            mine.begin()
            theirs.begin()
    assert mine.stored[:4] == pytest.approx(theirs.q, abs=0.02)  # a trace below 0.001 is dropped


def test_each_tiling_has_one_tile_and_neighbours_share_most():
    tiling = Tiling(np.array([0.0, -1.0]), np.array([1.0, 1.0]), 4, 8)
    here, near, far = (tiling.rows(np.array(point), grow=True) for point in ([0.5, 0.0], [0.56, 0.0], [0.9, 0.9]))
    assert len(here) == 8
    assert 6 <= np.sum(here == near) < 8
    assert not np.any(here == far)
    assert np.array_equal(tiling.rows(np.array([-99.0, 99.0]), grow=False), np.full(8, -1))


def test_actions_of_any_box_and_discrete_are_levels_in_their_order():
    levels = Levels(spaces.Box(np.array([-2.0, 0.0]), np.array([2.0, 1.0]), dtype=np.float64), 3)
    assert levels.n == 9
    assert levels.action(levels.nearest(np.array([-1.0, 1.0]))).tolist() == [-2.0, 1.0]
    assert levels.action(levels.nearest(np.array([0.1, -9.0]))).tolist() == [0.0, 0.0]
    counted = Levels(spaces.Discrete(3, start=-1), 3)
    assert [counted.action(counted.nearest(np.array([wanted]))) for wanted in (-1.0, 0.2, 1.0)] == [-1, 0, 1]


def test_bounds_are_those_of_the_space_or_else_of_what_was_seen():
    low, high = bounds(spaces.Box(np.array([0.0, -np.inf, -3e38]), np.array([1.0, 5.0, 3e38]), dtype=np.float64))
    assert np.isnan(low).tolist() == np.isnan(high).tolist() == [False, True, True]
    low, high = widened(low, high, np.array([[0.5, 0.0, 10.0], [0.6, 2.0, 20.0]]))
    assert low.tolist() == pytest.approx([0.0, -0.2, 9.0])
    assert high.tolist() == pytest.approx([1.0, 2.2, 21.0])


@pytest.mark.parametrize(("what", "position", "reward"), [("reward", 0.5, np.nan), ("observation", np.inf, 1.0)])
def test_what_an_environment_gives_that_is_no_number_is_told(what: str, position: float, reward: float) -> None:
    class Broken(Homing):
        def step(self, action: Any) -> tuple[Any, float, bool, bool, dict[str, Any]]:
            return np.array([position]), reward, False, False, {}

    with pytest.raises(StageError, match=f"the environment's {what} is"):
        learn_on(Broken(), overrides=SHORT)


@pytest.mark.parametrize("space", [spaces.MultiBinary(3), spaces.Box(-np.inf, np.inf, (1,))])
def test_actions_without_levels_are_refused(space):
    with pytest.raises(ConfigError, match=r"its actions are .*; allowed: Discrete, or a Box with bounds"):
        Levels(space, 3)


def test_harmonics_have_periods_from_four_actions_to_an_episode_in_each_dimension_by_itself():
    rng = np.random.default_rng(0)
    drawn = [Harmonics.drawn(2, 100.0, rng) for _ in range(2000)]
    periods = 2.0 * np.pi / np.array([one.frequency for one in drawn])
    assert periods.min() >= 4.0
    assert periods.max() <= 100.0
    assert np.median(periods) == pytest.approx(20.0, rel=0.1)  # the geometric mean of 4 and 100
    assert abs(np.corrcoef(np.array([one.phase for one in drawn]).T)[0, 1]) < 0.1


def test_a_module_in_a_name_is_refused_and_not_imported():
    with pytest.raises(ConfigError, match=r"'bench.environment' is 'antigravity:Up-v0'; allowed: the name of"):
        learn_on("antigravity:Up-v0")
    assert "antigravity" not in sys.modules


def test_by_its_name_it_is_cached_and_the_command_compares_with_its_exploration(here):
    brief = ["bench.episodes=30", "bench.evaluation_episodes=3"]
    learned = learn_on("CartPole-v1", seed=0, overrides=brief)
    assert learned.metrics["gain"] == learned.metrics["frozen_return"] - learned.metrics["replayed_return"]
    assert len(learned.policy.values) == learned.metrics["tiles"]
    command = [sys.executable, "-P", "-m", "kendama_cli.cli.main", "bench", "CartPole-v1", "--seeds", "1", "--json"]
    done = subprocess.run([*command, *brief], capture_output=True, text=True, check=True)
    (row,) = json.loads(done.stdout)
    assert row["frozen_return"] == learned.metrics["frozen_return"]
    with pytest.raises(StageError, match="environment 'Nowhere-v0' cannot be made"):
        learn_on("Nowhere-v0", overrides=brief)


def test_exploration_by_single_random_actions_learns_too():
    own = dataclasses.replace(configuration(SHORT)["bench"], exploration="epsilon_greedy")
    learner = TabularLearner(Homing(), own, np.random.default_rng(0))
    returns = [learner.episode().total_reward for _ in range(200)]
    assert np.mean(returns[-50:]) > np.mean(returns[:50])
    assert np.isnan(learner.evaluated(2)["replayed_return"])


def test_without_gymnasium_the_command_says_so(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    for name in [one for one in sys.modules if one.startswith("kendama_cli.plugins.bench.")]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, "gymnasium", None)
    assert main(["bench", "CartPole-v1"]) == 2
    line = "this needs module 'gymnasium', which is not installed; pip install '.[gym]' in a checkout of kendama"
    assert capsys.readouterr().err == f"kendama: {line}\n"
