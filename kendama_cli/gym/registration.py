"""Registers the environments; importing this module does it, once."""

from __future__ import annotations

import gymnasium
from gymnasium.envs.registration import WrapperSpec

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
    gymnasium.register(GAME, entry_point="kendama_cli.gym.free_cup:Game", max_episode_steps=5 * _PER_SECOND)
