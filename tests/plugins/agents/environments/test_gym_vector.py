"""Many swing-ups at once: the numbers of single ones, bodies and noise of their own, and what is refused."""

from __future__ import annotations

import numpy as np
import pytest

from kendama_cli.errors import ConfigError

gymnasium = pytest.importorskip("gymnasium", reason="the extra 'gym' is not installed")
from kendama_cli.gym import SWING_UP, SwingUp, SwingUpVector  # noqa: E402 - needs gymnasium

RAIL = "simulation/engine=rail"
STILL = {"noise": 0.0}


def accelerations(n: int, steps: int, seed: int) -> np.ndarray:
    """Harmonics, which bring the ball up, of random frequency: (steps, n, 1), held for 0.1 s each."""
    rng = np.random.default_rng(seed)
    rates, sizes = rng.uniform(3.0, 8.0, n), rng.choice([-1.0, 1.0], n) * rng.uniform(0.1, 1.0, n)
    return (sizes * np.cos(rates * 0.1 * np.arange(steps)[:, None]))[:, :, None].astype(np.float32)


@pytest.mark.parametrize("task", ["hard", "paper_caught", "easy"])
def test_without_noise_each_is_the_single_environment_with_its_actions(task: str) -> None:
    overrides, n = [f"learn/task={task}"], 24
    many = SwingUpVector(n, overrides, 0.1, actions="continuous", shaping=10.0, gamma=0.9)
    one = SwingUp([RAIL, *overrides], 0.1, actions="continuous", shaping=10.0, gamma=0.9)
    actions = accelerations(n, 40, 10050)
    first, _ = many.reset(seed=0, options=STILL)
    seen, rewards, ends = [first], [], []
    for action in actions:
        observations, reward, terminated, truncated, info = many.step(action)
        seen.append(observations)
        rewards.append(reward)
        ends.append((terminated, truncated, info["outcome"], info["duration_s"]))
    outcomes = set()
    for i in range(n):
        observation, _ = one.reset(seed=0, options=STILL)
        np.testing.assert_array_equal(seen[0][i], observation)
        for k in range(len(actions)):
            observation, reward, terminated, truncated, info = one.step(actions[k, i])
            np.testing.assert_allclose(seen[k + 1][i], observation, rtol=1e-5, atol=1e-5)
            assert rewards[k][i] == pytest.approx(reward, abs=1e-5)
            assert (ends[k][0][i], ends[k][1][i]) == (terminated, truncated)
            if terminated or truncated:
                assert ends[k][2][i] == info["outcome"]
                assert ends[k][3][i] == pytest.approx(info["duration_s"])
                outcomes.add(info["outcome"])
                break
    assert len(outcomes) >= 2, "the actions show too little"


def test_after_an_end_the_next_step_hangs_the_ball_anew_and_no_other_is_disturbed() -> None:
    many = gymnasium.make_vec(
        SWING_UP, num_envs=3, vectorization_mode="vector_entry_point", overrides=["learn/task=paper_caught"]
    )
    many.reset(seed=0, options=STILL)
    ended = np.zeros(3, bool)
    for _ in range(40):
        observations, reward, terminated, truncated, info = many.step(np.array([4, 2, 2]))
        if ended[0]:
            assert abs(observations[0][2]) < 1e-6
            assert (reward[0], terminated[0], truncated[0]) == (0.0, False, False)
            break
        ended = terminated | truncated
        assert ended.tolist() == [bool(info["outcome"][0]), False, False]
    assert ended[0], "the first never left the workspace"
    np.testing.assert_allclose(observations[1:, :4], 0.0, atol=1e-5)
    assert observations[1][4] < observations[0][4], "its time goes on"


@pytest.mark.parametrize("task", ["hard_random", "paper_caught"])
def test_each_is_over_several_rollouts_the_single_environment_of_its_seed_alone(task: str) -> None:
    overrides, seeds, steps = [f"learn/task={task}"], [10061, 10060, 10063], 120
    actions = np.random.default_rng(10062).integers(0, 5, (steps, 3))
    many, other = SwingUpVector(3, overrides), SwingUpVector(2, overrides)
    seen = [(many.reset(seed=seeds)[0], np.zeros(3), np.zeros(3, bool))]
    for action in actions:
        observations, rewards, terminated, truncated, _ = many.step(action)
        seen.append((observations, rewards, terminated | truncated))
    resets = 0
    for i, seed in enumerate(seeds):
        one, ended = SwingUp(overrides), False
        np.testing.assert_allclose(seen[0][0][i], one.reset(seed=seed)[0], rtol=1e-6)
        for k, action in enumerate(actions[:, i], start=1):
            if ended:
                observation, reward, ended = one.reset()[0], 0.0, False
                resets += 1
            else:
                observation, reward, terminated, truncated, _ = one.step(action)
                ended = terminated or truncated
            np.testing.assert_allclose(seen[k][0][i], observation, rtol=1e-5, atol=1e-5)
            assert (seen[k][1][i], seen[k][2][i]) == (pytest.approx(reward, abs=1e-5), ended)
    assert resets >= 2, "no rollout ended"
    np.testing.assert_array_equal(other.reset(seed=10060)[0], seen[0][0][[1, 0]], "10060 and 10061")


def test_a_longer_rope_a_denser_air_and_a_delay_act_as_in_the_single_environment() -> None:
    options = {"noise": 0.0, "body": {"rope": 1.05, "drag": 3.0, "delay_s": 0.02, "acceleration": 0.9}}
    many, one = SwingUpVector(2, hold_s=0.1, actions="continuous"), SwingUp([RAIL], 0.1, actions="continuous")
    many.reset(seed=0, options=options)
    one.reset(seed=0, options=options)
    for k in range(12):
        action = np.array([np.cos(0.5 * k)], np.float32)
        together = many.step(np.stack([action, -action]))[0]
        alone = one.step(action)[0]
        np.testing.assert_allclose(together[0], alone, rtol=1e-5, atol=1e-5)
        np.testing.assert_allclose(together[1][:4], -alone[:4], rtol=1e-5, atol=1e-5)


@pytest.mark.parametrize(
    ("make", "told"),
    [
        (lambda: SwingUpVector(0), "'num_envs' is 0; allowed: a whole number, 1 or more"),
        (lambda: SwingUpVector(2, ["simulation/engine=dart"]), "simulation/engine=rail"),
        (lambda: SwingUpVector(2, actions="both"), "'actions' is 'both'; allowed: discrete, continuous"),
        (lambda: SwingUpVector(2, hold_s=1e-4), "'hold_s' is 0.0001; allowed: from learn.step_s"),
        (lambda: SwingUpVector(2).reset(options={"sound": 1}), "option 'sound' is unknown; allowed: noise, body, cup"),
        (lambda: SwingUpVector(2).reset(options={"cup": 9}), "option 'cup' is 9; allowed: 0.5 to 4"),
        (
            lambda: SwingUpVector(2).reset(options={"body": {"rope": 3.0}}),
            "option 'body.rope' is 3.0; allowed: 0.5 to 2",
        ),
        (
            lambda: SwingUpVector(2).reset(options={"body": {"rope": 0.0}}),
            "option 'body.rope' is 0.0; allowed: 0.5 to 2",
        ),
        (lambda: SwingUpVector(2).reset(options={"body": 3}), "option 'body' is 3; allowed: a dictionary of rope"),
        (lambda: SwingUpVector(2).reset(seed=[1]), "'seed' has 1 entries; allowed: 2, one for each"),
        (lambda: SwingUpVector(2, shaping=float("nan")), "'shaping' is nan; allowed: a finite number"),
        (lambda: SwingUpVector(2, shaping=10.0), "'gamma' is None; allowed: 0 to 1, your agent's discount"),
        (lambda: SwingUpVector(2, shaping=10.0, gamma=1.1), "'gamma' is 1.1; allowed: 0 to 1"),
        (
            lambda: SwingUpVector(2, "learn/task=paper_caught"),
            "'overrides' is 'learn/task=paper_caught'; allowed: a list",
        ),
        (
            lambda: SwingUpVector(2, hold_s=0.02).reset(options={"body": {"delay_s": 0.05}}),
            "a delay of 0.05 s is longer than an action is held, 0.02 s",
        ),
    ],
)
def test_what_is_not_allowed_is_told_in_one_line(make, told: str) -> None:
    with pytest.raises(ConfigError) as caught:
        make()
    assert told in str(caught.value)
    assert "\n" not in str(caught.value)


def test_actions_that_are_none_are_refused() -> None:
    discrete, continuous = SwingUpVector(2), SwingUpVector(2, actions="continuous")
    for many in (discrete, continuous):
        with pytest.raises(gymnasium.error.ResetNeeded):
            many.step(many.action_space.sample())
        many.reset(seed=0)
    for actions in (np.array([0, 5]), np.array([-1, 0]), np.array([0.5, 1.0]), np.array([0])):
        with pytest.raises(gymnasium.error.InvalidAction, match="whole numbers 0 to 4"):
            discrete.step(actions)
    for actions in (np.array([[0.0], [1.5]]), np.array([[0.0], [np.nan]]), np.zeros(2)):
        with pytest.raises(gymnasium.error.InvalidAction, match=r"\(2, 1\) numbers, -1 to 1"):
            continuous.step(actions)


def test_reset_in_the_step_of_an_end_it_is_gymnasiums_own_vector_of_single_ones() -> None:
    same_step, options = (
        gymnasium.vector.AutoresetMode.SAME_STEP,
        {"actions": "continuous", "shaping": 5.0, "gamma": 0.9},
    )
    many = SwingUpVector(6, ["learn/task=easy"], 0.1, autoreset_mode=same_step, **options)
    single = [lambda: SwingUp(["learn/task=easy"], 0.1, **options)] * 6
    theirs = gymnasium.vector.SyncVectorEnv(single, autoreset_mode=same_step)
    assert many.metadata["autoreset_mode"] == theirs.metadata["autoreset_mode"]
    np.testing.assert_array_equal(many.reset(seed=10060)[0], theirs.reset(seed=10060)[0])
    ended = 0
    for action in accelerations(6, 90, 10060):
        one, other = many.step(action), theirs.step(action)
        for mine, peer in zip(one[:4], other[:4], strict=True):
            np.testing.assert_allclose(mine, peer, rtol=1e-5, atol=1e-5)
        over = one[2] | one[3]
        ended += int(over.sum())
        if over.any():
            np.testing.assert_array_equal(one[4]["_final_obs"], other[4]["_final_obs"])
            for i in np.flatnonzero(over):
                np.testing.assert_allclose(one[4]["final_obs"][i], other[4]["final_obs"][i], rtol=1e-5, atol=1e-5)
                assert one[4]["final_info"]["outcome"][i] == other[4]["final_info"]["outcome"][i]
    assert ended > 12, "each of them ends more than once"


def test_another_way_to_reset_is_refused() -> None:
    with pytest.raises(ConfigError, match=r"'autoreset_mode' is .*DISABLED.*; allowed: AutoresetMode.NEXT_STEP, SAME"):
        SwingUpVector(2, autoreset_mode=gymnasium.vector.AutoresetMode.DISABLED)


def test_for_stable_baselines3_it_is_the_same_vector_and_tells_how_each_ended() -> None:
    pytest.importorskip("stable_baselines3", reason="Stable-Baselines3 is not installed")
    from kendama_cli.gym.stable_baselines3 import SwingUpVecEnv  # noqa: PLC0415
    from stable_baselines3.common.vec_env import DummyVecEnv  # noqa: PLC0415

    options = {"actions": "continuous", "normalised": True}
    many = SwingUpVecEnv(4, ["learn/task=easy"], hold_s=0.1, **options)
    theirs = DummyVecEnv([lambda: SwingUp(["learn/task=easy"], 0.1, **options)] * 4)
    for one in (many, theirs):
        one.seed(10070)
    np.testing.assert_array_equal(many.reset(), theirs.reset())
    ended = 0
    for action in accelerations(4, 90, 10070):
        *mine, told = many.step(action)
        *peer, expected = theirs.step(action)
        for ours, other in zip(mine, peer, strict=True):
            np.testing.assert_allclose(ours, other, rtol=1e-5, atol=1e-5)
        for i in np.flatnonzero(mine[2]):
            ended += 1
            np.testing.assert_allclose(told[i]["terminal_observation"], expected[i]["terminal_observation"], atol=1e-5)
            for name in ("TimeLimit.truncated", "is_success"):
                assert told[i][name] == expected[i][name]
    assert ended > 8
