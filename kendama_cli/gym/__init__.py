"""The game as Gymnasium environments (needs the extra ``gym``).

    import gymnasium, kendama_cli.gym
    env = gymnasium.make("kendama/SwingUp-v1")
    envs = gymnasium.make_vec("kendama/SwingUp-v1", num_envs=1024, vectorization_mode="vector_entry_point")

Importing this package registers them; ``gymnasium.make("kendama_cli.gym:kendama/SwingUp-v1")`` does both.
"""

from __future__ import annotations

import gymnasium

from kendama_cli.gym.free_cup import Catch, Game
from kendama_cli.gym.swing_up import SwingUp
from kendama_cli.gym.swing_up_vector import SwingUpVector

__all__ = ["Catch", "Game", "SwingUp", "SwingUpVector"]

SWING_UP, CATCH, GAME = "kendama/SwingUp-v1", "kendama/Catch-v0", "kendama/Game-v0"

if SWING_UP not in gymnasium.registry:
    gymnasium.register(
        SWING_UP,
        entry_point="kendama_cli.gym.swing_up:SwingUp",
        vector_entry_point="kendama_cli.gym.swing_up_vector:SwingUpVector",
    )
    gymnasium.register(CATCH, entry_point="kendama_cli.gym.free_cup:Catch")
    gymnasium.register(GAME, entry_point="kendama_cli.gym.free_cup:Game")
