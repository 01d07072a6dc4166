"""Many compiled swing-ups as a ``VecEnv`` of Stable-Baselines3, which is to be installed beside it."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
from gymnasium.vector import AutoresetMode
from stable_baselines3.common.vec_env import VecEnv

from kendama_cli.plugins.agents.environments.swing_up_vector import SwingUpVector


class SwingUpVecEnv(VecEnv):  # type: ignore[misc]  # untyped where it is not installed
    """``num_envs`` environments of SwingUp for an agent of Stable-Baselines3; wrap it in its ``VecMonitor``."""

    def __init__(self, num_envs: int, overrides: Sequence[str] = (), **options: Any) -> None:
        """Take SwingUpVector's arguments; raises ConfigError as that does."""
        self._many = SwingUpVector(num_envs, overrides, autoreset_mode=AutoresetMode.SAME_STEP, **options)
        self._actions: Any = None
        super().__init__(num_envs, self._many.single_observation_space, self._many.single_action_space)

    def reset(self) -> Any:
        """Hang every ball; return the observations (n, 5). ``seed`` says from which seed on."""
        first = self._seeds[0]
        observations, _ = self._many.reset(seed=None if first is None else int(first))
        self._reset_seeds()
        return observations

    def step_async(self, actions: Any) -> None:
        """Take the actions of ``step_wait``."""
        self._actions = actions

    def step_wait(self) -> tuple[Any, Any, Any, list[dict[str, Any]]]:
        """Hold the actions; return observations, rewards, ends, and what ended each."""
        observations, rewards, terminated, truncated, info = self._many.step(self._actions)
        over = terminated | truncated
        told: list[dict[str, Any]] = [{} for _ in range(self.num_envs)]
        for i in np.flatnonzero(over).tolist():
            told[i] = {
                "terminal_observation": info["final_obs"][i],
                "TimeLimit.truncated": bool(truncated[i] and not terminated[i]),
                "is_success": bool(info["final_info"]["is_success"][i]),
            }
        return observations, rewards.astype(np.float32), over, told

    def close(self) -> None:
        """Free nothing: there is nothing to free."""

    def get_attr(self, attr_name: str, indices: Any = None) -> list[Any]:
        """Return an attribute of the whole, once for each environment asked for; raises AttributeError for none."""
        return [getattr(self._many, attr_name) for _ in self._asked(indices)]

    def set_attr(self, attr_name: str, value: Any, indices: Any = None) -> None:
        """Raise NotImplementedError: the environments are one."""
        raise NotImplementedError(f"'{attr_name}' cannot be set: the environments are one; make others")

    def env_method(self, method_name: str, *arguments: Any, indices: Any = None, **options: Any) -> list[Any]:
        """Raise NotImplementedError: the environments are one."""
        raise NotImplementedError(f"'{method_name}' cannot be called for each: the environments are one")

    def env_is_wrapped(self, wrapper_class: type, indices: Any = None) -> list[bool]:
        """Return False for each environment asked for."""
        return [False for _ in self._asked(indices)]

    def _asked(self, indices: Any) -> Iterable[int]:
        found: Iterable[int] = self._get_indices(indices)
        return found
