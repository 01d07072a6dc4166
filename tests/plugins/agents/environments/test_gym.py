"""The swing-up as a Gymnasium environment: the interface's own checks, the same physics, and a learner from outside."""

from __future__ import annotations

import math
import subprocess
import sys

import numpy as np
import pytest

from kendama_cli.errors import ConfigError
from kendama_cli.simulation.swingup.environment import SwingUpEnvironment
from tests.learning.settings_files import game_settings, learn_settings

gymnasium = pytest.importorskip("gymnasium", reason="the extra 'gym' is not installed")
from kendama_cli.gym import CATCH, GAME, SWING_UP_GOAL  # noqa: E402 - needs gymnasium
from kendama_cli.gym import SWING_UP as NAME  # noqa: E402
from tests.plugins.agents.environments.cross_entropy import LinearPolicy, improved, played  # noqa: E402 - needs gymnasium

RAIL = "simulation/engine=rail"
QUIET = [RAIL, *(f"learn.noise.{key}=0.0" for key in ("start_angle_deg", "start_position_m", "angle_reading_deg"))]
QUIET += ["learn.noise.rate_reading_rad_s=0.0", "learn.noise.acceleration=0.0"]


@pytest.mark.parametrize("overrides", [[], ["learn/task=paper_caught"], ["simulation/engine=dart"]])
def test_gymnasiums_own_checks_pass(overrides):
    from gymnasium.utils.env_checker import check_env  # noqa: PLC0415

    check_env(gymnasium.make(NAME, overrides=overrides).unwrapped, skip_render_check=True)


@pytest.mark.filterwarnings("ignore:.*render_mode 'human' needs a display")
@pytest.mark.parametrize(
    ("name", "options"),
    [
        (NAME, {"overrides": [RAIL], "actions": "continuous", "normalised": True, "shaping": 10.0, "gamma": 0.99}),
        (CATCH, {}),
        (CATCH, {"actions": "discrete", "normalised": True}),
        (GAME, {}),
    ],
)
def test_gymnasiums_own_checks_pass_with_pictures_for_every_kind_of_action(name, options):
    from gymnasium.utils.env_checker import check_env  # noqa: PLC0415

    check_env(gymnasium.make(name, render_mode="rgb_array", **options).unwrapped)


@pytest.mark.parametrize("name", [CATCH, GAME, SWING_UP_GOAL])
def test_gymnasiums_own_vectors_are_the_single_ones_with_their_seeds(name):
    many = gymnasium.make_vec(name, num_envs=2, vectorization_mode="sync")
    seen, _ = many.reset(seed=7)
    actions = many.action_space.sample()
    following, rewards, *_ = many.step(actions)
    for i in range(2):
        env = gymnasium.make(name)
        alone, _ = env.reset(seed=7 + i)
        after, reward, *_ = env.step(actions[i])
        for one, all_of_them in ((alone, seen), (after, following)):
            for key, value in one.items() if isinstance(one, dict) else [(..., one)]:
                assert np.array_equal(all_of_them[key][i], value)
        assert rewards[i] == reward


def test_gymnasiums_own_wrapper_makes_pixels_the_observation():
    from gymnasium.wrappers import AddRenderObservation  # noqa: PLC0415

    env = AddRenderObservation(gymnasium.make(NAME, render_mode="rgb_array"))
    first, _ = env.reset(seed=0)
    assert first.shape == env.observation_space.shape == (480, 640, 3)
    assert (env.step(4)[0] != first).any()


def test_naming_the_module_registers_it_in_a_new_interpreter():
    script = "import gymnasium; print(gymnasium.make('kendama_cli.gym:kendama/SwingUp-v1').action_space)"
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert done.stdout == "Discrete(5)\n"


def test_an_action_held_here_is_the_same_action_held_in_the_learning_environment():
    env = gymnasium.make(NAME, overrides=[*QUIET, "simulation/engine=rail"], hold_s=0.1).unwrapped
    desired = [4, 4, 0, 0, 0, 4, 4, 0]
    observation, _ = env.reset(seed=0)
    seen = [observation]
    for action in desired:
        observation, *_ = env.step(np.int64(action))
        seen.append(observation)
    environment = SwingUpEnvironment(learn_settings("hard"), game_settings())
    rolling = environment.rolling(environment.noiseless())
    reading, t_s = next(rolling)
    for action, observation in zip([*desired, 0], seen, strict=True):
        np.testing.assert_allclose(observation, [*reading, 4.0 - t_s], rtol=1e-6, atol=1e-6)  # float32
        reading, t_s = rolling.send((learn_settings("hard").actions_m_s2[action], t_s + 0.1 - 1e-9))
    assert t_s == pytest.approx(0.9)


def test_a_rollout_follows_from_its_seed_and_is_noisy():
    env = gymnasium.make(NAME)
    first, again, other = (env.reset(seed=seed)[0] for seed in (3, 3, 4))
    np.testing.assert_array_equal(first, again)
    assert (first != other).any()


def test_doing_nothing_is_truncated_when_time_is_up():
    env = gymnasium.make(NAME, overrides=["learn.rollout_s=1.0"], hold_s=0.05)
    env.reset(seed=0)
    for k in range(20):
        _, reward, terminated, truncated, info = env.step(2)
        assert not terminated
        assert truncated == (k == 19)
    assert reward == learn_settings("hard").reward.timeout
    assert info["outcome"] == "timeout"
    assert not info["is_success"]


def test_leaving_the_workspace_terminates_where_the_configuration_says_so():
    env = gymnasium.make(NAME, overrides=["learn/task=paper_caught"])
    env.reset(seed=0)
    terminated, info = False, {}
    while not terminated:
        observation, reward, terminated, truncated, info = env.step(4)
        assert env.observation_space.contains(observation)
        assert not truncated
    assert info["outcome"] == "outside"
    assert reward < learn_settings("paper_caught").reward.outside + 1e-9


def test_stepping_after_the_end_is_refused():
    env = gymnasium.make(NAME, overrides=["learn.rollout_s=0.2"]).unwrapped
    with pytest.raises(gymnasium.error.ResetNeeded, match="call reset"):
        env.step(np.int64(0))


def test_a_continuous_action_that_is_no_number_is_refused():
    env = gymnasium.make(NAME, overrides=[RAIL], actions="continuous").unwrapped
    env.reset(seed=0)
    for action in ("left", None, 0.5, np.array([1.5])):
        with pytest.raises(gymnasium.error.InvalidAction, match="allowed: an array of one number from -1 to 1"):
            env.step(action)


def test_a_hold_shorter_than_a_time_step_is_refused_in_one_line():
    with pytest.raises(ConfigError, match=r"'hold_s' is 0.0001; allowed: from learn.step_s, 0.002, to learn.rollout_s"):
        gymnasium.make(NAME, hold_s=1e-4)


def test_a_cross_entropy_agent_from_outside_learns_the_swing_up():
    env = gymnasium.make(NAME, overrides=[RAIL, "learn/task=easy", "learn.goal.success=reached"], hold_s=0.05)
    rng = np.random.default_rng(0)
    untrained = np.mean([played(env, LinearPolicy.drawn(rng), seed)[1] for seed in range(20)])
    policy = improved(env, rng, generations=6, population=16)
    trained = np.mean([played(env, policy, seed)[1] for seed in range(1000, 1020)])
    assert trained >= 0.8 > untrained
    assert math.isfinite(played(env, policy, 0)[0])


@pytest.mark.parametrize("task", ["hard", "hard_random", "paper_caught", "easy"])
def test_a_ball_to_catch_has_just_been_let_go_on_either_side_and_can_be_reached(task):
    env = gymnasium.make(CATCH, overrides=[f"learn/task={task}"]).unwrapped
    begun = np.array([env.reset(seed=seed)[0] for seed in range(10000, 10040)])
    assert (begun[:, 2] > 0).any()
    assert (begun[:, 2] < 0).any()
    goal = learn_settings(task).goal
    angles = np.degrees(np.arctan2(np.abs(begun[:, 2]), -begun[:, 3]))
    assert np.abs(angles - goal.angle_deg).max() <= goal.tolerance_deg + 0.01


def test_a_window_out_of_which_nothing_can_be_caught_is_told_instead_of_searched_for_ever():
    env = gymnasium.make(CATCH, overrides=["learn.goal.angle_deg=60", "learn.goal.tolerance_deg=5"])
    with pytest.raises(ConfigError, match="none lets a ball fall within the cup's reach with a slack rope; widen it"):
        env.reset(seed=0)
