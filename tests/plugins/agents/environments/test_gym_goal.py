"""The goal-conditioned swing-up: Gymnasium's checks, a reward by goals alone, and goals that can be reached."""

from __future__ import annotations

import math

import numpy as np
import pytest

from kendama_cli.errors import ConfigError

gymnasium = pytest.importorskip("gymnasium", reason="the extra 'gym' is not installed")
from kendama_cli.gym import SWING_UP_GOAL  # noqa: E402 - needs gymnasium

RAIL = ["simulation/engine=rail"]


@pytest.fixture(scope="module")
def env():
    return gymnasium.make(SWING_UP_GOAL, overrides=RAIL, hold_s=0.05).unwrapped


def pumped(env, goal: tuple[float, float], seed: int = 0):
    """Every step of a rollout that pushes against the ball's swing, as gymnasium gives it."""
    observation, _ = env.reset(seed=seed, options={"goal": goal})
    steps, ended = [], False
    while not ended:
        _, _, angle, rate, _ = observation["observation"]
        fraction = np.array([-math.copysign(1.0, math.cos(angle) * rate)], np.float32)
        steps.append(env.step(fraction))
        observation, _, terminated, truncated, _ = steps[-1]
        ended = terminated or truncated
    return steps


@pytest.mark.filterwarnings("ignore:.*render_mode 'human' needs a display")
@pytest.mark.parametrize("options", [{}, {"actions": "discrete", "normalised": True, "reward": "dense"}])
def test_gymnasiums_own_checks_pass(options):
    from gymnasium.utils.env_checker import check_env  # noqa: PLC0415

    check_env(gymnasium.make(SWING_UP_GOAL, overrides=RAIL, render_mode="rgb_array", **options).unwrapped)


@pytest.mark.parametrize("reward", ["sparse", "dense"])
def test_the_reward_of_a_step_is_that_of_its_goals_one_by_one_or_many_at_once(reward):
    env = gymnasium.make(SWING_UP_GOAL, overrides=RAIL, hold_s=0.05, reward=reward).unwrapped
    steps = pumped(env, (1.0, 2.0))
    achieved = np.array([step[0]["achieved_goal"] for step in steps])
    desired = np.array([step[0]["desired_goal"] for step in steps])
    given = np.array([step[1] for step in steps])
    np.testing.assert_array_equal(env.compute_reward(achieved, desired, [{}] * len(steps)), given)
    one = env.compute_reward(achieved[3], desired[3], {})
    assert np.shape(one) == ()
    assert one == given[3]
    hindsight = env.compute_reward(achieved, np.repeat(achieved[-1:], len(steps), axis=0), {})
    assert hindsight[-1] == 0.0
    assert hindsight.min() < 0.0


@pytest.mark.parametrize("goal", [(0.8, 2.0), (1.2, 3.0), (1.5, 4.5)])
def test_a_goal_that_is_reached_ends_the_rollout_at_once_within_the_tolerance(env, goal):
    *before, (observation, reward, terminated, truncated, info) = pumped(env, goal)
    assert all(step[1] == -1.0 and not step[4]["is_success"] for step in before)
    assert (terminated, truncated, reward, info["is_success"]) == (True, False, 0.0, True)
    apart = np.abs(observation["achieved_goal"] - np.array(goal))
    assert apart[0] <= 0.1 + 1e-5
    assert apart[1] <= 0.5 + 1e-5


def test_a_goal_out_of_reach_is_truncated_when_time_is_up(env):
    *_, (_, reward, terminated, truncated, info) = pumped(env, (0.2, 40.0))
    assert (terminated, truncated, reward, info["is_success"]) == (False, True, -1.0, False)


def test_left_and_right_count_alike(env):
    sides = set()
    for seed in range(8):
        observation = pumped(env, (0.8, 1.5), seed)[-1][0]
        _, _, angle, rate, _ = observation["observation"]
        assert observation["achieved_goal"] == pytest.approx([abs(angle), math.copysign(1.0, angle) * rate])
        sides.add(angle > 0.0)
    assert sides == {True, False}


def test_another_goal_is_drawn_in_every_reset_and_the_seed_repeats_it(env):
    goals = [env.reset(seed=seed)[0]["desired_goal"] for seed in (0, *[None] * 99)]
    assert env.reset(seed=0)[0]["desired_goal"] == pytest.approx(goals[0])
    angles, rates = np.transpose(goals)
    assert len(set(angles.tolist())) == 100
    assert math.radians(30.0) <= angles.min() < 0.7
    assert 1.4 < angles.max() <= math.radians(90.0) + 1e-6
    assert 1.0 <= rates.min() < 1.5
    assert 4.5 < rates.max() <= 5.0


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"reward": "shaped"}, "'reward' is 'shaped'; allowed: sparse, dense"),
        ({"angles_deg": (90.0, 30.0)}, r"'angles_deg' is \(90.0, 30.0\); allowed: \(low, high\)"),
        ({"tolerance": (0.1, 0.0)}, r"'tolerance' is \(0.1, 0.0\); allowed: two numbers above 0"),
        ({"tolerance": 0.1}, r"'tolerance' is 0.1; allowed: two numbers above 0"),
        ({"rates_rad_s": 3.0}, r"'rates_rad_s' is 3.0; allowed: \(low, high\)"),
    ],
)
def test_options_that_are_none_are_refused_in_one_line(options, words):
    with pytest.raises(ConfigError, match=words):
        gymnasium.make(SWING_UP_GOAL, overrides=RAIL, **options)


def test_a_goal_that_is_none_is_refused_in_one_line(env):
    with pytest.raises(ConfigError, match=r"option 'goal' is \(4.0, 1.0\); allowed: angle above 0 to pi"):
        env.reset(options={"goal": (4.0, 1.0)})
    with pytest.raises(ConfigError, match=r"option 'goal' is 'up'; allowed: angle above 0 to pi"):
        env.reset(options={"goal": "up"})
    with pytest.raises(ConfigError, match=r"option 'goals' is unknown; allowed: goal, noise, body, cup"):
        env.reset(options={"goals": (1.0, 1.0)})
