"""Registers the environments; importing this module does it, once."""

from __future__ import annotations

import gymnasium

SWING_UP, CATCH, GAME = "kendama/SwingUp-v1", "kendama/Catch-v0", "kendama/Game-v0"
SWING_UP_GOAL = "kendama/SwingUpGoal-v1"

if SWING_UP not in gymnasium.registry:
    gymnasium.register(
        SWING_UP,
        entry_point="kendama_cli.gym.swing_up:SwingUp",
        vector_entry_point="kendama_cli.gym.swing_up_vector:SwingUpVector",
    )
    gymnasium.register(SWING_UP_GOAL, entry_point="kendama_cli.gym.swing_up_goal:SwingUpGoal")
    gymnasium.register(CATCH, entry_point="kendama_cli.gym.free_cup:Catch")
    gymnasium.register(GAME, entry_point="kendama_cli.gym.free_cup:Game")
