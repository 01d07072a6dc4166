"""The game as Gymnasium environments (needs the extra ``gym``).

    import gymnasium, kendama_cli.gym
    env = gymnasium.make("kendama/SwingUp-v1")
    envs = gymnasium.make_vec("kendama/SwingUp-v1", num_envs=1024, vectorization_mode="vector_entry_point")

Importing this package registers them; ``gymnasium.make("kendama_cli.gym:kendama/SwingUp-v1")`` does both.
"""

from __future__ import annotations

import gymnasium
from gymnasium.envs.registration import WrapperSpec

from kendama_cli.gym.free_cup import Catch as Catch
from kendama_cli.gym.free_cup import GameEnv as GameEnv
from kendama_cli.gym.swing_up import SwingUp as SwingUp
from kendama_cli.gym.swing_up_goal import SwingUpGoal as SwingUpGoal
from kendama_cli.gym.swing_up_vector import SwingUpVector as SwingUpVector

SWING_UP, CATCH, GAME = "kendama/SwingUp-v1", "kendama/Catch-v0", "kendama/Game-v0"
SWING_UP_GOAL = "kendama/SwingUpGoal-v1"
_PER_SECOND = 500
"""Actions in a second, were each held for one time step: time ends a rollout before Gymnasium's count of them does."""

if SWING_UP not in gymnasium.registry:
    gymnasium.register(
        SWING_UP,
        entry_point="kendama_cli.gym.swing_up:SwingUp",
        vector_entry_point="kendama_cli.gym.swing_up_vector:SwingUpVector",
        max_episode_steps=4 * _PER_SECOND,
    )
    gymnasium.register(
        SWING_UP_GOAL,
        entry_point="kendama_cli.gym.swing_up_goal:SwingUpGoal",
        max_episode_steps=4 * _PER_SECOND,
        additional_wrappers=(WrapperSpec("GoalReward", "kendama_cli.gym.swing_up_goal:GoalReward", {}),),
    )
    gymnasium.register(CATCH, entry_point="kendama_cli.gym.free_cup:Catch", max_episode_steps=_PER_SECOND)
    gymnasium.register(GAME, entry_point="kendama_cli.gym.free_cup:GameEnv", max_episode_steps=5 * _PER_SECOND)
