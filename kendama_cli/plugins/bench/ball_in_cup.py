"""The task ball_in_cup-catch of the DeepMind Control Suite, from the model file of an installed ``dm_control``.

Only its XML is read, through MuJoCo: dm_control itself need not load beside the installed MuJoCo. Observations, reward,
time step and start follow its definition (Tassa et al. 2018, https://arxiv.org/abs/1801.00690).
"""

from __future__ import annotations

import importlib.util
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

NAME = "dm_control/ball_in_cup-catch-v0"
STEPS, SUBSTEPS = 1000, 10
"""Actions of an episode, 20 s, and time steps of 2 ms of an action."""


def register() -> None:
    """Make it known to Gymnasium, once."""
    if NAME not in gymnasium.registry:
        gymnasium.register(NAME, entry_point=f"{__name__}:BallInCup", max_episode_steps=STEPS)


class BallInCup(gymnasium.Env[NDArray[np.float64], NDArray[np.float32]]):
    """Observation (8,): position and velocity of cup and ball along x and z. Action (2,): forces on the cup.

    Reward 1 for each action after which the ball is in the cup. An episode ends by time alone.
    """

    def __init__(self) -> None:
        """Raise FileNotFoundError where there is no dm_control, ImportError where there is no MuJoCo."""
        import mujoco  # noqa: PLC0415 - an extra

        found = importlib.util.find_spec("dm_control")
        if found is None or not found.submodule_search_locations:
            raise FileNotFoundError("its model file comes with dm_control: pip install --no-deps dm_control")
        model = mujoco.MjModel.from_xml_path(str(Path(found.submodule_search_locations[0]) / "suite/ball_in_cup.xml"))
        self._mujoco, self._model, self._data = mujoco, model, mujoco.MjData(model)
        model.opt.timestep = 0.002
        self._ball = model.geom("ball").id
        self._room = model.site("target").size[[0, 2]] - model.geom("ball").size[0]
        self.observation_space: Any = spaces.Box(-np.inf, np.inf, (8,))
        self.action_space: Any = spaces.Box(-1.0, 1.0, (2,))

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[NDArray[np.float64], dict[str, Any]]:
        """Place the ball at random, where it touches nothing."""
        super().reset(seed=seed)
        while True:
            self._mujoco.mj_resetData(self._model, self._data)
            self._data.joint("ball_x").qpos[0] = self.np_random.uniform(-0.2, 0.2)
            self._data.joint("ball_z").qpos[0] = self.np_random.uniform(0.2, 0.5)
            self._mujoco.mj_forward(self._model, self._data)
            if self._data.ncon == 0:
                return self._observation(), {}

    def step(self, action: Any) -> tuple[NDArray[np.float64], float, bool, bool, dict[str, Any]]:
        """Hold the forces for 20 ms."""
        self._data.ctrl[:] = action
        self._mujoco.mj_step(self._model, self._data, SUBSTEPS)
        apart = np.abs(self._data.site("target").xpos - self._data.body("ball").xpos)[[0, 2]]
        return self._observation(), float((apart < self._room).all()), False, False, {}

    def _observation(self) -> NDArray[np.float64]:
        return np.concatenate([self._data.qpos, self._data.qvel])
