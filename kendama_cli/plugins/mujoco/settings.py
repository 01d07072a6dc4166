"""Settings of ``hardware=mujoco`` and ``camera=mujoco``."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Literal

from kendama_cli.errors import ConfigError
from kendama_cli.schema.settings import setting
from kendama_cli.settings.camera import VirtualCamera


@dataclass(frozen=True)
class MujocoHardware:
    """An arm of a MuJoCo model with its own actuators, as a process of its own behind UDP on loopback, in lockstep."""

    moves: ClassVar[bool] = False
    read_by: ClassVar[str] = "kendama_cli.plugins.mujoco.files:read_lines"

    kind: Literal["mujoco"]
    model: str = setting(
        "MJCF model, with actuators, of the arm that 'robot' describes; or a folder of MuJoCo Menagerie.",
        file=True,
        in_folder="kendama_cli.plugins.mujoco.files:arm_files",
        brings="kendama_cli.plugins.mujoco.files:brought_files",
    )
    timestep_s: float = setting("Time step of MuJoCo, in place of the model's own [s].", above=0, at_most=0.002)
    control_period_s: float = setting("Period of one position command, in whole time steps [s].", above=0, at_most=0.02)
    settle_s: float = setting("Before a rollout, the arm must come to rest within this time [s].", above=0, at_most=60)
    silence_s: float = setting(
        "The connection counts as lost when an answer takes longer and the process is gone [s].", above=0
    )
    rope_scale: float = setting("Factor on the rope's length.", above=0)
    drag_scale: float = setting("Factor on the air's force.", at_least=0)
    joint_noise_rad: float = setting("Standard deviation of the joint angles read [rad].", at_least=0)
    ball_noise_m: float = setting("Standard deviation of the tracked ball and cup, per axis [m].", at_least=0)

    def __post_init__(self) -> None:
        if not self.model:
            raise ConfigError("model", "'model' is empty; set it to an arm's model, as in hardware.model=iiwa14.xml")
        steps = self.control_period_s / self.timestep_s
        if steps < 0.5 or abs(steps - round(steps)) > 1e-6:
            raise ConfigError(
                "control_period_s",
                f"'control_period_s' is {self.control_period_s:g}; allowed: a multiple of timestep_s, which is "
                f"{self.timestep_s:g}",
            )


@dataclass(frozen=True)
class MujocoCamera(VirtualCamera):
    """Images of the scene's poses by MuJoCo's renderer."""

    kind: Literal["mujoco"] = setting("MuJoCo renders the images.")  # type: ignore[assignment]
