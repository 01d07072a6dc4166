"""The game as Gymnasium environments (needs the extra ``gym``); ``kendama_cli.gym`` is the name that users import.

    import gymnasium, kendama_cli.gym
    env = gymnasium.make("kendama/SwingUp-v1")
    envs = gymnasium.make_vec("kendama/SwingUp-v1", num_envs=1024, vectorization_mode="vector_entry_point")

Importing that name registers them; each is imported when it is first asked for.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from kendama_cli.plugins.agents.environments.free_cup import Catch as Catch
    from kendama_cli.plugins.agents.environments.free_cup import GameEnv as GameEnv
    from kendama_cli.plugins.agents.environments.swing_up import SwingUp as SwingUp
    from kendama_cli.plugins.agents.environments.swing_up_goal import SwingUpGoal as SwingUpGoal
    from kendama_cli.plugins.agents.environments.swing_up_vector import SwingUpVector as SwingUpVector

SWING_UP, CATCH, GAME = "kendama/SwingUp-v1", "kendama/Catch-v0", "kendama/Game-v0"
SWING_UP_GOAL = "kendama/SwingUpGoal-v1"
MODULES = {
    "Catch": "free_cup",
    "GameEnv": "free_cup",
    "SwingUp": "swing_up",
    "SwingUpGoal": "swing_up_goal",
    "SwingUpVector": "swing_up_vector",
}
"""Module of each environment here, imported when it is first asked for."""
_PER_SECOND = 500
"""Actions in a second, were each held for one time step: time ends a rollout before Gymnasium's count of them does."""


def __getattr__(name: str) -> Any:
    if name not in MODULES:
        raise AttributeError(f"module '{__name__}' has no attribute '{name}'")
    return getattr(importlib.import_module(f"{__name__}.{MODULES[name]}"), name)


def register() -> None:
    """Register the environments with Gymnasium, unless they are."""
    import gymnasium  # noqa: PLC0415 - an extra

    def place(name: str) -> str:
        return f"{__name__}.{MODULES[name]}:{name}"

    if SWING_UP in gymnasium.registry:
        return
    goal_reward = gymnasium.envs.registration.WrapperSpec("GoalReward", f"{__name__}.swing_up_goal:GoalReward", {})
    gymnasium.register(
        SWING_UP,
        entry_point=place("SwingUp"),
        vector_entry_point=place("SwingUpVector"),
        max_episode_steps=4 * _PER_SECOND,
    )
    gymnasium.register(
        SWING_UP_GOAL,
        entry_point=place("SwingUpGoal"),
        max_episode_steps=4 * _PER_SECOND,
        additional_wrappers=(goal_reward,),
    )
    gymnasium.register(CATCH, entry_point=place("Catch"), max_episode_steps=_PER_SECOND)
    gymnasium.register(GAME, entry_point=place("GameEnv"), max_episode_steps=5 * _PER_SECOND)
