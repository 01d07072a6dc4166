"""Settings of ``hardware=mujoco``."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Literal

from kendama_cli.errors import ConfigError
from kendama_cli.schema.settings import setting


@dataclass(frozen=True)
class MujocoHardware:
    """An arm of a MuJoCo model with its own actuators, as a process of its own behind UDP on loopback, in lockstep."""

    moves: ClassVar[bool] = False

    kind: Literal["mujoco"]
    model: str = setting("model of the arm that 'robot' describes, with its actuators (MJCF)", file=True)
    timestep_s: float = setting("step of MuJoCo, in place of the model's own [s]", above=0, at_most=0.002)
    control_period_s: float = setting(
        "one position command per period, held until the next; whole steps [s]", above=0, at_most=0.02
    )
    settle_s: float = setting("longest time in which the arm comes to rest before a rollout [s]", above=0, at_most=60)
    silence_s: float = setting("an answer that takes longer, with no process there, is a broken line [s]", above=0)
    rope_scale: float = setting("factor on the rope's length", above=0)
    drag_scale: float = setting("factor on the air's force", at_least=0)
    joint_noise_rad: float = setting("standard deviation of the joint angle readings [rad]", at_least=0)
    ball_noise_m: float = setting("standard deviation of the tracked ball and cup, per axis [m]", at_least=0)

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
