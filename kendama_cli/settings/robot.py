"""The arm: what it is, how it holds the cup, how it is controlled, and how a perturbed twin of it differs."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import PurePath
from typing import ClassVar

from kendama_cli.errors import ConfigError
from kendama_cli.schema.settings import setting


@dataclass(frozen=True)
class ToolSettings:
    """The handle between the arm's tip link and the cup."""

    handle_m: tuple[float, float, float] = setting("rope's tie point under the cup, in the frame of the tip link [m]")
    cup_axis: tuple[float, float, float] = setting("direction in which the cup opens, in the frame of the tip link")

    def __post_init__(self) -> None:
        if math.hypot(*self.cup_axis) < 1e-6:
            raise ConfigError("cup_axis", f"'cup_axis' is {list(self.cup_axis)}; allowed: any direction but zero")


UNNAMED = "urdf"
"""The name in conf/robot/urdf.yaml, which is for any arm."""
PER_JOINT = (
    "home_rad",
    "lower_rad",
    "upper_rad",
    "velocity_rad_s",
    "effort_nm",
    "acceleration_rad_s2",
    "rotor_inertia_kg_m2",
    "coulomb_nm",
    "viscous_nm_s",
    "stribeck_nm",
    "stribeck_rad_s",
    "redundancy_weights",
    "link_radius_m",
)
"""The fields of RobotSettings with one value per moving joint."""


@dataclass(frozen=True)
class RobotSettings:
    """An arm from a URDF, placed in the world, holding the cup; per-joint lists run from base to tip.

    Where null is allowed the arm finds a value of its own: see robot_model.model, whose attributes hold what counts.
    """

    read_by: ClassVar[str] = "kendama_cli.robot_model.description:read_lines"
    """What reads its file before the first stage, and says in lines what was read."""

    tool: ToolSettings
    name: str = setting("name in messages and logs")
    path: str = setting(
        "robot description (URDF), or package://example-robot-data/...; its limits count where no setting gives them",
        file=True,
    )
    base_link: str | None = setting(
        "link that stands at the base pose, what is before it left out; null: the root link"
    )
    tip_link: str | None = setting("link that holds the handle; null: the tool frame at the end of the longest chain")
    locked_joints: tuple[str, ...] = setting("joints before the tip that are locked where they are, as a lift is")
    base_position_m: tuple[float, float, float] = setting("position of the base link in the world [m]")
    base_heading_rad: float = setting("rotation of the base link about the world's z; the swing plane is x-z [rad]")
    home_rad: tuple[float, ...] | None = setting(
        "posture with the cup upright where a swing starts; null: the centre of the joints' ranges [rad]"
    )
    lower_rad: tuple[float, ...] | None = setting("lower position limits; null: the file's [rad]", absent=None)
    upper_rad: tuple[float, ...] | None = setting("upper position limits; null: the file's [rad]", absent=None)
    velocity_rad_s: tuple[float, ...] | None = setting(
        "speed limits, for a file that gives none, or a placeholder; null: the file's [rad/s]", above=0, absent=None
    )
    effort_nm: tuple[float, ...] | None = setting(
        "effort limits, for a file that gives none, or a placeholder; null: the file's [Nm]", above=0, absent=None
    )
    acceleration_rad_s2: tuple[float, ...] | None = setting(
        "acceleration limits, which a URDF has not; null: top speed within 0.15 s [rad/s^2]", above=0
    )
    rotor_inertia_kg_m2: tuple[float, ...] | None = setting(
        "motor inertia seen at the joint, on the diagonal of H (armature); null: none [kg m^2]", at_least=0
    )
    coulomb_nm: tuple[float, ...] | None = setting(
        "Coulomb friction Fc, known to the controller; null: <dynamics friction> of the file [Nm]", at_least=0
    )
    viscous_nm_s: tuple[float, ...] | None = setting(
        "viscous friction b, known to the controller; null: <dynamics damping> of the file [Nm s/rad]", at_least=0
    )
    stribeck_nm: tuple[float, ...] | None = setting(
        "friction Fs at standstill beyond Fc, known to the controller; null: none [Nm]", at_least=0
    )
    stribeck_rad_s: tuple[float, ...] | None = setting(
        "speed vs over which Fs fades; null: 0.05 of the speed limit [rad/s]", above=0
    )
    redundancy_weights: tuple[float, ...] | None = setting(
        "cost of a joint's motion if there are more joints than needed; null: inverse square of its velocity limit",
        above=0,
    )
    link_radius_m: tuple[float, ...] | None = setting(
        "radius of the capsule from a joint's origin to the next one's, for clearances; null: 0.06 [m]", above=0
    )
    stiffness_1_s2: float = setting("computed torque: Kp of the joint error; Kd = 2 sqrt Kp [1/s^2]", above=0)

    @property
    def called(self) -> str:
        """Name as the user knows the arm: that of its description's file, where the settings have none of their own."""
        return self.name if self.name != UNNAMED else PurePath(self.path).stem

    def __post_init__(self) -> None:
        if not self.path:
            raise ConfigError("path", "'path' is empty; set it to a robot description, as in robot.path=my_arm.urdf")
        lengths = {name: len(values) for name in PER_JOINT if (values := getattr(self, name)) is not None}
        first = next(iter(lengths), "")
        for name, found in lengths.items():
            if found != lengths[first]:
                message = f"'{name}' has {found} values; allowed: {lengths[first]}, one per joint as {first} has"
                raise ConfigError(name, message)


@dataclass(frozen=True)
class Imperfection:
    """Difference between a simulated robot and its controller's model: a twin, or one perturbed repeat."""

    rope_scale: float = setting("factor on the rope's length", above=0)
    rope_scale_spread: float = setting("uniform +- spread of that factor, sampled at every reset", at_least=0, below=1)
    rope_kg: float | None = setting(
        "mass of the rope as a chain of links; null: as the game's, 0: a spring without mass [kg]",
        at_least=0,
        at_most=0.02,
    )
    ball_start_m: float = setting(
        "uniform +- offset of the ball's start along x, sampled at every reset [m]", at_least=0
    )
    joint_friction_nm: float = setting("Coulomb friction of every joint that nobody models [Nm]", at_least=0)
    joint_friction_fraction: float = setting("fraction of each joint's known friction on top of it", at_least=0)
    lag_s: float = setting("first-order lag of the reference [s]", at_least=0)
    latency_s: float = setting("pure delay of the command [s]", at_least=0)
    joint_noise_rad: float = setting("standard deviation of the joint angle readings [rad]", at_least=0)
    ball_noise_m: float = setting("standard deviation of the tracked ball and cup, per axis [m]", at_least=0)
    mass_scale: float = setting("factor on the ball's mass", above=0)
    drag_scale: float = setting("factor on the air's force", at_least=0)
    tie_friction_m: float = setting("moment of the rope's friction at its tie, over its tension [m]", at_least=0)
    gravity_tilt_rad: float = setting("gravity leans so far toward +x in the frame of arm and cameras [rad]")
    backlash_rad: float = setting("play of every joint between motor and link, from end to end [rad]", at_least=0)
    drift_m: float = setting(
        "standard deviation of a correlated error of the tracked ball and cup, per axis [m]", at_least=0
    )
    drift_s: float = setting("time over which that error forgets itself [s]", above=0)
    tracking_delay_s: float = setting("the tracked ball and cup are so old when they are reported [s]", at_least=0)
    tracking_lost_fraction: float = setting(
        "fraction of the periods in which ball and cup are not tracked and stay where they were reported last",
        at_least=0,
        below=1,
    )
