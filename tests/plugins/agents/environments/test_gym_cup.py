"""A cup that is asked for at a reset is the cup of an environment that was made with it."""

from __future__ import annotations

import numpy as np
import pytest

from kendama_cli.errors import ConfigError

gymnasium = pytest.importorskip("gymnasium", reason="the extra 'gym' is not installed")
from kendama_cli.config.compose import composed  # noqa: E402 - needs gymnasium
from kendama_cli.config.site import find_site  # noqa: E402
from kendama_cli.gym import SWING_UP, SwingUpVector  # noqa: E402
from tests.plugins.agents.environments.test_gym_vector import accelerations  # noqa: E402

TASK = ["learn/task=easy"]
RADIUS_M = float(composed(find_site(), TASK)["game"]["cup"]["radius_m"])
CUP = 2.5
WIDE = [*TASK, f"game.cup.radius_m={CUP * RADIUS_M}"]
ACTIONS = accelerations(12, 40, 10810)


def told(environment, options):
    """Observations and rewards of twelve rollouts of harmonics."""
    seen = []
    for i in range(ACTIONS.shape[1]):
        observation, _ = environment.reset(seed=10820 + i, options=options)
        for action in ACTIONS[:, i]:
            seen.append(observation["observation"] if isinstance(observation, dict) else observation)
            observation, reward, terminated, truncated, info = environment.step(action)
            seen[-1] = np.array([*seen[-1], reward, info["is_success"]])
            if terminated or truncated:
                break
    return np.concatenate(seen)


@pytest.mark.parametrize("name", [SWING_UP, "kendama/SwingUpGoal-v1", "kendama/Catch-v0", "kendama/Game-v0"])
def test_it_is_that_of_an_environment_with_such_a_cup_and_the_next_reset_has_the_plain_one(name):
    options = {"actions": "continuous", "hold_s": 0.1}
    plain, wide = (gymnasium.make(name, overrides=one, **options).unwrapped for one in (TASK, WIDE))
    before, asked, again = (told(plain, one) for one in (None, {"cup": CUP}, {}))
    np.testing.assert_array_equal(asked, told(wide, None))
    np.testing.assert_array_equal(again, before)
    if name != "kendama/SwingUpGoal-v1":  # its rope meets the cup in no rollout here
        assert asked.shape != before.shape or not np.array_equal(asked, before)


def test_the_vector_has_it_in_every_rollout_from_the_reset_on():
    many, wide = SwingUpVector(12, TASK, 0.1, actions="continuous"), SwingUpVector(12, WIDE, 0.1, actions="continuous")
    many.reset(seed=0)
    for one, options in ((many, {"cup": CUP}), (wide, None)):
        one.reset(seed=10830, options=options)
    caught = 0
    for action in [*ACTIONS, *ACTIONS]:
        mine, theirs = many.step(action), wide.step(action)
        for left, right in zip(mine[:4], theirs[:4], strict=True):
            np.testing.assert_array_equal(left, right)
        caught += int((mine[1] > 50.0).sum())
    assert caught


def test_catch_has_no_other_option():
    with pytest.raises(ConfigError, match=r"options \['noise'\] are unknown; allowed: cup"):
        gymnasium.make("kendama/Catch-v0").unwrapped.reset(options={"noise": 0.0})
