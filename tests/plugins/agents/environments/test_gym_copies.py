"""Environments in the midst of a rollout: pickled and copied they go on alike; what is wrongly asked is one error."""

from __future__ import annotations

import copy
import pickle

import numpy as np
import pytest

from kendama_cli.errors import ConfigError

gymnasium = pytest.importorskip("gymnasium", reason="the extra 'gym' is not installed")
from kendama_cli.gym import SWING_UP  # noqa: E402 - needs gymnasium

RAIL = "simulation/engine=rail"
GOAL = "kendama/SwingUpGoal-v1"


def went_on(environment, steps):
    """What an agent sees and gets in further steps, as flat numbers."""
    rng, seen = np.random.default_rng(10700), []
    environment.action_space.seed(10701)
    for _ in range(steps):
        observation, reward, terminated, truncated, _ = environment.step(environment.action_space.sample())
        parts = observation.values() if isinstance(observation, dict) else [observation]
        seen.append(np.concatenate([*parts, [reward, terminated, truncated]]))
        if terminated or truncated:
            environment.reset(seed=int(rng.integers(1000)))
    return np.array(seen)


@pytest.mark.parametrize("name", [SWING_UP, GOAL])
@pytest.mark.parametrize("overrides", [[RAIL], ["simulation/engine=dart"]], ids=["rail", "dart"])
@pytest.mark.parametrize("again", [lambda one: pickle.loads(pickle.dumps(one)), copy.deepcopy], ids=["pickle", "copy"])
def test_a_copy_goes_on_with_identical_observations(name, overrides, again):
    environment = gymnasium.make(name, overrides=overrides).unwrapped
    environment.reset(seed=10702)
    for _ in range(3):
        environment.step(environment.action_space.sample())
    copied = again(environment)
    assert (went_on(copied, 30) == went_on(environment, 30)).all()


def test_a_copy_before_reset_and_after_the_end_waits_for_reset():
    environment = gymnasium.make(SWING_UP, overrides=[RAIL]).unwrapped
    fresh = pickle.loads(pickle.dumps(environment))
    environment.reset(seed=10703)
    ended = False
    while not ended:
        *_, terminated, truncated, _ = environment.step(environment.action_space.sample())
        ended = terminated or truncated
    for one in (fresh, pickle.loads(pickle.dumps(environment))):
        with pytest.raises(gymnasium.error.ResetNeeded):
            one.step(0)
        assert (one.reset(seed=10704)[0] == environment.reset(seed=10704)[0]).all()


@pytest.mark.parametrize("name", [SWING_UP, GOAL])
def test_options_that_are_no_dictionary_are_refused(name):
    environment = gymnasium.make(name, overrides=[RAIL]).unwrapped
    with pytest.raises(ConfigError, match=r"'options' is 5; allowed: a dictionary of noise, body, cup, or None"):
        environment.reset(options=5)


@pytest.mark.parametrize("count", [1.5, "2", True, 0])
def test_a_number_of_environments_is_whole(count):
    from kendama_cli.gym.swing_up_vector import SwingUpVector  # noqa: PLC0415 - compiled code

    with pytest.raises(ConfigError, match=f"'num_envs' is {count!r}; allowed: a whole number, 1 or more"):
        SwingUpVector(count)


def test_a_wrong_action_of_many_is_named_with_its_index():
    many = gymnasium.make_vec(SWING_UP, num_envs=3, overrides=[RAIL])
    many.reset(seed=10705)
    with pytest.raises(gymnasium.error.InvalidAction, match=r"action 99 of environment 1; allowed: \(3,\) whole"):
        many.step(np.array([0, 99, 1]))
    with pytest.raises(gymnasium.error.InvalidAction, match=r"actions of shape \(2,\) and type int64; allowed: \(3,\)"):
        many.step(np.array([0, 1]))
    fractions = gymnasium.make_vec(SWING_UP, num_envs=3, overrides=[RAIL], actions="continuous")
    fractions.reset(seed=10706)
    with pytest.raises(gymnasium.error.InvalidAction, match=r"action nan of environment 2; allowed: \(3, 1\) numbers"):
        fractions.step(np.array([[0.0], [1.0], [np.nan]]))
    with pytest.raises(gymnasium.error.InvalidAction, match=r"actions of shape .* and type"):
        fractions.step([["a"], ["b"], ["c"]])
