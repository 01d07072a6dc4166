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

    handle_m: tuple[float, float, float] = setting(
        "Tie point of the rope under the cup, in the frame of the tip link [m]."
    )
    cup_axis: tuple[float, float, float] = setting("Direction in which the cup opens, in the frame of the tip link.")

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

    Null takes a value from the file or a rule (robot_model.model), whose attributes hold the resulting values.
    """

    read_by: ClassVar[str] = "kendama_cli.robot_model.description:read_lines"
    """What reads its file before the first stage, and says in lines what was read."""

    tool: ToolSettings
    name: str = setting("Name of the arm in messages and logs.")
    path: str = setting(
        "Robot description: a URDF file, or package://example-robot-data/... Its limits apply where no setting gives "
        "them.",
        file=True,
    )
    base_link: str | None = setting(
        "Link that stands at the base position; links before it are ignored. Null takes the root link."
    )
    tip_link: str | None = setting(
        "Link that holds the handle; null takes the tool frame at the end of the longest chain."
    )
    locked_joints: tuple[str, ...] = setting("Joints before the tip that stay locked in place, such as a lift.")
    base_position_m: tuple[float, float, float] = setting("Position of the base link in the world [m].")
    base_heading_rad: float = setting("Rotation of the base link about z of the world [rad]. The swing plane is x-z.")
    home_rad: tuple[float, ...] | None = setting(
        "Joint angles with the cup upright at the start of a swing [rad]; null takes the centre of each joint's range."
    )
    lower_rad: tuple[float, ...] | None = setting(
        "Lower limits of the joint angles [rad]; null takes those of the file.", absent=None
    )
    upper_rad: tuple[float, ...] | None = setting(
        "Upper limits of the joint angles [rad]; null takes those of the file.", absent=None
    )
    velocity_rad_s: tuple[float, ...] | None = setting(
        "Velocity limits of the joints, for a file without them or with placeholders [rad/s]; null takes those of the "
        "file.",
        above=0,
        absent=None,
    )
    effort_nm: tuple[float, ...] | None = setting(
        "Torque limits of the joints, for a file without them or with placeholders [Nm]; null takes those of the file.",
        above=0,
        absent=None,
    )
    acceleration_rad_s2: tuple[float, ...] | None = setting(
        "Acceleration limits of the joints, which a URDF cannot state [rad/s^2]. Null takes those that reach the "
        "velocity limit within 0.15 s.",
        above=0,
    )
    rotor_inertia_kg_m2: tuple[float, ...] | None = setting(
        "Inertia of each motor as seen at its joint, added to the diagonal of the inertia matrix H (armature) [kg "
        "m^2]; null for none.",
        at_least=0,
    )
    coulomb_nm: tuple[float, ...] | None = setting(
        "Coulomb friction Fc of each joint, known to the controller [Nm]; null takes <dynamics friction> of the file.",
        at_least=0,
    )
    viscous_nm_s: tuple[float, ...] | None = setting(
        "Viscous friction b of each joint, known to the controller [Nm s/rad]; null takes <dynamics damping> of the "
        "file.",
        at_least=0,
    )
    stribeck_nm: tuple[float, ...] | None = setting(
        "Friction Fs at standstill beyond Fc, known to the controller [Nm]; null for none.", at_least=0
    )
    stribeck_rad_s: tuple[float, ...] | None = setting(
        "Velocity vs over which Fs fades [rad/s]; null takes 0.05 of the velocity limit.", above=0
    )
    redundancy_weights: tuple[float, ...] | None = setting(
        "Cost of each joint's motion, if the arm has more joints than the task needs. A costly joint moves less; null "
        "takes the inverse square of its velocity limit.",
        above=0,
    )
    link_radius_m: tuple[float, ...] | None = setting(
        "Radius of the capsule from each joint's origin to the next one's, for clearances [m]; null takes 0.06 m.",
        above=0,
    )
    stiffness_1_s2: float = setting(
        "Stiffness Kp of the computed torque control on the joint error [1/s^2]; the damping is Kd = 2 sqrt Kp.",
        above=0,
    )

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

    rope_scale: float = setting("Factor on the rope's length.", above=0)
    rope_scale_spread: float = setting(
        "The factor on the rope's length varies by up to this, either way, and is sampled at every reset.",
        at_least=0,
        below=1,
    )
    ball_start_m: float = setting(
        "The ball starts up to this far from its nominal position along x, either way, sampled at every reset [m].",
        at_least=0,
    )
    joint_friction_nm: float = setting(
        "Coulomb friction of every joint that the controller does not model [Nm].", at_least=0
    )
    joint_friction_fraction: float = setting(
        "Each joint has more friction than its controller models, by this fraction of its known friction.", at_least=0
    )
    lag_s: float = setting("Time constant of the first-order lag between the arm and its reference [s].", at_least=0)
    latency_s: float = setting("Pure delay of every command [s].", at_least=0)
    joint_noise_rad: float = setting("Standard deviation of the readings of the joint angles [rad].", at_least=0)
    ball_noise_m: float = setting(
        "Standard deviation of the tracked positions of ball and cup, per axis [m].", at_least=0
    )
    mass_scale: float = setting("Factor on the ball's mass.", above=0)
    drag_scale: float = setting("Factor on the air drag.", at_least=0)
    tie_friction_m: float = setting(
        "Friction torque of the rope at its tie point, per unit of tension [m].", at_least=0
    )
    gravity_tilt_rad: float = setting("Angle by which gravity leans towards +x in the frame of arm and cameras [rad].")
    backlash_rad: float = setting("Backlash of every joint between motor and link, from end to end [rad].", at_least=0)
    drift_m: float = setting(
        "Standard deviation of a slowly drifting error of the tracked positions of ball and cup, per axis [m].",
        at_least=0,
    )
    drift_s: float = setting("Correlation time of the drifting error [s].", above=0)
    tracking_delay_s: float = setting(
        "Age of the tracked positions of ball and cup when they are reported [s].", at_least=0
    )
    tracking_lost_fraction: float = setting(
        "Fraction of the periods in which tracking loses ball and cup and reports their last positions again.",
        at_least=0,
        below=1,
    )
