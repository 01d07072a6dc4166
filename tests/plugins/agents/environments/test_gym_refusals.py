"""Wrong options, numbers of environments and actions: each is one error."""

from __future__ import annotations

import numpy as np
import pytest

from kendama_cli.errors import ConfigError

gymnasium = pytest.importorskip("gymnasium", reason="the extra 'gym' is not installed")
from kendama_cli.gym import SWING_UP  # noqa: E402 - needs gymnasium

RAIL = "simulation/engine=rail"
GOAL = "kendama/SwingUpGoal-v1"


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
