"""The arm: what it is, how it holds the cup, how it is controlled, and how a perturbed twin of it differs."""

from __future__ import annotations

import math
from dataclasses import dataclass

from kendama_cli.errors import ConfigError
from kendama_cli.settings.schema import setting


@dataclass(frozen=True)
class ToolSettings:
    """The handle between the arm's tip link and the cup."""

    handle_m: tuple[float, float, float] = setting("rope's tie point under the cup, in the frame of the tip link [m]")
    cup_axis: tuple[float, float, float] = setting("direction in which the cup opens, in the frame of the tip link")

    def __post_init__(self) -> None:
        if math.hypot(*self.cup_axis) < 1e-6:
            raise ConfigError("cup_axis", f"'cup_axis' is {list(self.cup_axis)}; allowed: any direction but zero")


@dataclass(frozen=True)
class RobotSettings:
    """An arm from a URDF, placed in the world, holding the cup; per-joint lists run from base to tip."""

    tool: ToolSettings
    name: str = setting("name in messages and logs")
    urdf: str = setting("robot description; position, speed and effort limits come from it", file=True)
    tip_link: str = setting("link that holds the handle")
    base_position_m: tuple[float, float, float] = setting("where the root link stands in the world [m]")
    base_heading_rad: float = setting("turn of the root link about the world's z; the swing plane is x-z [rad]")
    home_rad: tuple[float, ...] = setting("posture with the cup upright where a swing starts [rad]")
    acceleration_rad_s2: tuple[float, ...] = setting("acceleration limits; a URDF has none [rad/s^2]", above=0)
    rotor_inertia_kg_m2: tuple[float, ...] = setting("motor inertia seen at the joint [kg m^2]", at_least=0)
    coulomb_nm: tuple[float, ...] = setting("Coulomb friction, known to the controller [Nm]", at_least=0)
    viscous_nm_s: tuple[float, ...] = setting("viscous friction, known to the controller [Nm s/rad]", at_least=0)
    stiffness_1_s2: float = setting("computed torque: Kp of the joint error; Kd = 2 sqrt Kp [1/s^2]", above=0)

    def __post_init__(self) -> None:
        n = len(self.home_rad)
        for name in ("acceleration_rad_s2", "rotor_inertia_kg_m2", "coulomb_nm", "viscous_nm_s"):
            if len(getattr(self, name)) != n:
                found = len(getattr(self, name))
                raise ConfigError(name, f"'{name}' has {found} values; allowed: {n}, one per joint as home_rad has")


@dataclass(frozen=True)
class Imperfection:
    """How a simulated robot differs from what its controller believes: a twin, or one perturbed repeat."""

    rope_scale: float = setting("factor on the rope's length", above=0)
    rope_scale_spread: float = setting("uniform +- spread of that factor, drawn at every reset", at_least=0, below=1)
    ball_start_m: float = setting("uniform +- offset of the ball's start along x, drawn at every reset [m]", at_least=0)
    joint_friction_nm: float = setting("Coulomb friction of every joint that nobody models [Nm]", at_least=0)
    lag_s: float = setting("first-order lag of the reference [s]", at_least=0)
    latency_s: float = setting("pure delay of the command [s]", at_least=0)
    joint_noise_rad: float = setting("standard deviation of the joint angle readings [rad]", at_least=0)
    ball_noise_m: float = setting("standard deviation of the tracked ball and cup, per axis [m]", at_least=0)
