"""Rules that every environment keeps: specs, vectors of Gymnasium, success in ``info``, one law of rewards, shaping."""

from __future__ import annotations

import math

import numpy as np
import pytest

from kendama_cli.learning import reward as law
from kendama_cli.learning.learners import begin_learner
from kendama_cli.learning.state import SwingState
from tests.learning.settings_files import game_settings, learn_settings

gymnasium = pytest.importorskip("gymnasium", reason="the extra 'gym' is not installed")
from gymnasium.vector import AutoresetMode  # noqa: E402 - needs gymnasium
from kendama_cli.gym.swing_up import HOLD_S  # noqa: E402

from kendama_cli.gym import CATCH, GAME, SWING_UP, SWING_UP_GOAL, SwingUp, SwingUpVector  # noqa: E402

EVERY = [SWING_UP, SWING_UP_GOAL, CATCH, GAME]


@pytest.mark.filterwarnings("ignore:.*is different from the unwrapped version", "ignore:.*needs a display")
@pytest.mark.parametrize("name", EVERY)
def test_gymnasiums_checks_pass_on_what_make_gives(name: str) -> None:
    from gymnasium.utils.env_checker import check_env  # noqa: PLC0415

    check_env(gymnasium.make(name))


def test_the_rewards_of_goals_are_computed_through_gymnasiums_wrappers() -> None:
    env = gymnasium.make(SWING_UP_GOAL)  # HER and the checker of Stable-Baselines3 ask what make gives
    observation, _ = env.reset(seed=0)
    observation, reward, *_ = env.step(env.action_space.sample())
    assert env.compute_reward(observation["achieved_goal"], observation["desired_goal"], {}) == reward


@pytest.mark.parametrize("name", EVERY)
@pytest.mark.parametrize("hold_s", [None, 0.002])
def test_time_ends_a_rollout_within_the_steps_of_the_spec_however_short_an_action(name: str, hold_s) -> None:
    env = gymnasium.make(name, actions="continuous", **({} if hold_s is None else {"hold_s": hold_s}))
    env.reset(seed=10090)
    for steps in range(1, env.spec.max_episode_steps + 1):  # noqa: B007 - its last value is looked at
        *_, terminated, truncated, info = env.step(np.zeros(1, np.float32))
        if terminated or truncated:
            break
    assert truncated or name == CATCH
    assert steps <= gymnasium.spec(name).max_episode_steps
    assert info.get("outcome", "timeout") == "timeout", "the environment's own end, not a count of steps"


@pytest.mark.parametrize("name", EVERY)
@pytest.mark.parametrize("mode", [AutoresetMode.SAME_STEP, AutoresetMode.NEXT_STEP])
def test_gymnasiums_vectors_run_each_and_success_is_told_at_every_step(name: str, mode: AutoresetMode) -> None:
    vector = gymnasium.make_vec(name, 2, vectorization_mode="sync", vector_kwargs={"autoreset_mode": mode})
    vector.action_space.seed(10080)
    _, info = vector.reset(seed=10081)
    assert info["is_success"].tolist() == [False, False]
    ends = 0
    for _ in range(300):
        observations, _, terminated, truncated, info = vector.step(vector.action_space.sample())
        assert vector.observation_space.contains(observations)
        for i in np.flatnonzero(terminated | truncated):
            final = info["final_info"] if mode == AutoresetMode.SAME_STEP else info
            assert final["is_success"].dtype == bool
            assert final["_is_success"][i]
            ends += 1
    assert ends


def test_our_own_vector_is_cut_by_the_steps_that_are_asked_for_as_a_single_one_is() -> None:
    many = gymnasium.make_vec(SWING_UP, 2, vectorization_mode="vector_entry_point", max_episode_steps=7)
    one = gymnasium.make(SWING_UP, max_episode_steps=7)
    _, info = many.reset(seed=10082)
    assert info["is_success"].tolist() == [False, False]
    one.reset(seed=10082)
    for k in range(1, 8):
        _, rewards, terminated, truncated, info = many.step(np.array([4, 4]))
        single = one.step(4)
        assert (rewards[0], terminated[0], truncated[0]) == single[1:4]
        assert truncated.tolist() == [k == 7] * 2
        assert not info["_outcome"].any(), "it is the count of steps that ends it"
    observations, rewards, _, truncated, _ = many.step(np.array([4, 4]))
    np.testing.assert_allclose(observations[0], one.reset()[0], rtol=1e-6)
    assert (rewards.tolist(), truncated.tolist()) == ([0.0, 0.0], [False, False])


def test_a_term_added_to_the_law_of_rewards_reaches_the_vector(monkeypatch: pytest.MonkeyPatch) -> None:
    actions = np.random.default_rng(10083).integers(0, 5, 30)

    def rewarded() -> tuple[np.ndarray, np.ndarray]:
        many, one = SwingUpVector(1, ["learn/task=paper_caught"]), SwingUp(["learn/task=paper_caught"])
        many.reset(seed=10084)
        one.reset(seed=10084)
        together, alone = [], []
        for action in actions:
            _, reward, terminated, truncated, _ = one.step(action)
            alone.append(reward)
            together.append(many.step(np.array([action]))[1][0])
            if terminated or truncated:
                break
        return np.array(together), np.array(alone)

    def with_a_term(settings, x_m):
        return settings.step - settings.displacement_per_m * abs(x_m) - 3.0 * x_m**2

    before = rewarded()
    monkeypatch.setattr(law.step_reward, "__code__", with_a_term.__code__)
    after = rewarded()
    np.testing.assert_allclose(after[0], after[1], atol=1e-9)
    assert (np.abs(after[0] - before[0]) > 1e-6).sum() > 5
    np.testing.assert_allclose(before[0], before[1], atol=1e-9)


@pytest.mark.parametrize("gamma", [0.9, 0.99, 1.0])
@pytest.mark.parametrize("end", ["release", "outside", "time"])
def test_shaping_adds_to_a_rollouts_discounted_return_what_no_action_changes(gamma: float, end: str) -> None:
    overrides = {
        "release": ["learn/task=easy"],
        "outside": ["learn/task=paper_caught"],
        "time": ["learn.rollout_s=1.0"],
    }[end]
    game, weight = game_settings(), 50.0

    def potential(observation: np.ndarray) -> float:
        _, _, angle, rate, _ = observation.astype(float)
        energy = 1.0 - math.cos(angle) + 0.5 * game.rope.length_m / game.gravity_m_s2 * rate**2
        return weight * min(1.0, 0.5 * energy)

    plain, shaped = (SwingUp(overrides, actions="continuous", shaping=s, gamma=gamma) for s in (0.0, weight))
    many = SwingUpVector(1, overrides, actions="continuous", shaping=weight, gamma=gamma)
    first, _ = plain.reset(seed=10085)
    shaped.reset(seed=10085)
    many.reset(seed=10085)
    added, together, k, over = 0.0, 0.0, 0, False
    while not over:
        action = np.array([math.cos(5.0 * HOLD_S * k)], np.float32)
        observation, reward, terminated, truncated, info = plain.step(action)
        added += gamma**k * (shaped.step(action)[1] - reward)
        together += gamma**k * (many.step(action[None])[1][0] - reward)
        k, over = k + 1, terminated or truncated
    assert terminated == (end != "time"), info
    expected = -potential(first) + (gamma**k * potential(observation) if truncated else 0.0)
    assert (added, together) == (pytest.approx(expected, abs=1e-4), pytest.approx(expected, abs=1e-4))
    if end == "time":
        assert potential(observation) > 1.0, "which is why an agent has to bootstrap where time is up"


def test_the_products_own_learner_succeeds_in_what_make_gives() -> None:
    env = gymnasium.make(SWING_UP).unwrapped
    settings = learn_settings("hard", decision__min_s=HOLD_S, decision__max_s=HOLD_S)
    learner, rng, rewards = begin_learner(settings), np.random.default_rng(10091), settings.reward
    while learner.count.learned_at is None and learner.count.rollouts < settings.count.max_rollouts:
        observation, _ = env.reset(seed=int(rng.integers(2**31)))
        learner.begin_rollout(rng)
        over, reward, info, k = False, 0.0, {}, 0
        while not over:
            wanted_m_s2 = learner.act(SwingState(*observation[:4].tolist()), k * HOLD_S)
            observation, reward, terminated, truncated, info = env.step(settings.actions_m_s2.index(wanted_m_s2))
            over, k = terminated or truncated, k + 1
        missed = info["outcome"] == "missed"
        miss_m = rewards.missed_range_m * (1.0 - reward / rewards.missed) if missed else None
        learner.end_rollout(info["outcome"], SwingState(*observation[:4].tolist()), miss_m)
    assert learner.count.learned_at is not None
