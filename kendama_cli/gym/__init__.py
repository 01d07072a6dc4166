"""The game as Gymnasium environments (needs the extra ``gym``).

    import gymnasium, kendama_cli.gym
    env = gymnasium.make("kendama/SwingUp-v1")
    envs = gymnasium.make_vec("kendama/SwingUp-v1", num_envs=1024, vectorization_mode="vector_entry_point")

Importing this package registers them; ``gymnasium.make("kendama_cli.gym:kendama/SwingUp-v1")`` does both.
"""

from __future__ import annotations

from kendama_cli.gym.free_cup import Catch as Catch
from kendama_cli.gym.free_cup import Game as Game
from kendama_cli.gym.registration import CATCH as CATCH
from kendama_cli.gym.registration import GAME as GAME
from kendama_cli.gym.registration import SWING_UP as SWING_UP
from kendama_cli.gym.registration import SWING_UP_GOAL as SWING_UP_GOAL
from kendama_cli.gym.swing_up import SwingUp as SwingUp
from kendama_cli.gym.swing_up_goal import SwingUpGoal as SwingUpGoal
from kendama_cli.gym.swing_up_vector import SwingUpVector as SwingUpVector
