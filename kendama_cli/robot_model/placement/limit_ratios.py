"""Ratios of an arm's limits that a motion needs, joint by joint."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from kendama_cli.artifacts.motion_plan import JointTrajectory
from kendama_cli.errors import StageError
from kendama_cli.motion.sampling import thinning
from kendama_cli.robot_model.model import RobotModel
from kendama_cli.schema.arrays import Array

SAMPLE_S = 0.004
"""Efforts are looked at this often."""

UNITS = {"speed": "rad/s", "acceleration": "rad/s^2", "effort": "Nm"}


@dataclass(frozen=True)
class Leading:
    """The joint that needs the largest ``share`` of one kind of limit, and in words why that limit is in ``doubt``."""

    kind: str
    joint: str
    share: float
    limit: float
    doubt: str

    def __str__(self) -> str:
        limit = f"{self.limit:.2f} {UNITS[self.kind]}"
        return f"{self.share:.2f} of joint '{self.joint}' {self.kind} limit ({limit}){self.doubt}"


@dataclass(frozen=True)
class LimitRatios:
    """The peaks of a motion over the limits (n,), and how far each joint stays from its stops (n,) [rad]."""

    joint_names: tuple[str, ...]
    velocity: Array
    acceleration: Array
    effort: Array
    to_stop_rad: Array
    limits: tuple[Array, Array, Array]
    """of speed, acceleration and effort, (n,) each"""
    doubts: tuple[str, ...] = ("",) * len(UNITS)
    """what is doubtful about each of them"""

    @property
    def leading(self) -> tuple[Leading, ...]:
        """The leading joint of each kind of limit, the largest share first."""
        found = []
        kinds = (self.velocity, self.acceleration, self.effort)
        for kind, shares, limits, doubt in zip(UNITS, kinds, self.limits, self.doubts, strict=True):
            j = int(shares.argmax())
            found.append(Leading(kind, self.joint_names[j], float(shares[j]), float(limits[j]), doubt))
        return tuple(sorted(found, key=lambda one: -one.share))


def limit_ratios(arm: RobotModel, joints: JointTrajectory) -> LimitRatios:
    """Return the ratios of the limits of ``arm`` that ``joints`` needs: efforts by its inverse dynamics and known
    friction.
    """
    to_stop = arm.limits.to_stop_rad(joints.position_rad).min(axis=0)
    limits = (arm.limits.velocity_rad_s, arm.limits.acceleration_rad_s2, arm.limits.effort_nm)
    peaks = (
        np.abs(joints.velocity_rad_s).max(axis=0),
        np.abs(joints.acceleration_rad_s2).max(axis=0),
        np.abs(efforts_nm(arm, joints)).max(axis=0),
    )
    speed, change, effort = (peak / limit for peak, limit in zip(peaks, limits, strict=True))
    doubts = tuple(map(arm.limit_doubt, UNITS))
    return LimitRatios(arm.joint_names, speed, change, effort, to_stop, limits, doubts)


def efforts_nm(arm: RobotModel, joints: JointTrajectory) -> Array:
    """Return the torques (k, n) of ``joints``, about every ``SAMPLE_S``: equations.md eq. 2 without the rope's
    tension.
    """
    thin = thinning(joints.t_s, SAMPLE_S)
    speeds = joints.velocity_rad_s[::thin]
    samples = zip(joints.position_rad[::thin], speeds, joints.acceleration_rad_s2[::thin], strict=True)
    rigid = np.array([arm.rigid_effort_nm(*sample) for sample in samples])
    return rigid + arm.friction.torque_nm(speeds, np.sign(speeds))


def require_within_limits(arm: RobotModel, joints: JointTrajectory) -> LimitRatios:
    """Return the ratios of a motion within the limits; raises StageError, with joint and limit, if it exceeds one."""
    shares = limit_ratios(arm, joints)
    first = shares.leading[0]
    if first.share > 1.0:
        unit = UNITS[first.kind]
        raise StageError(
            f"joint '{first.joint}' of {arm.settings.name} would need {first.share * first.limit:.2f} {unit}; "
            f"allowed: {first.limit:.2f} {unit}{first.doubt}: "
            "play the motion slower (adapt.tau_range) or place the arm otherwise (adapt.placement=search)"
        )
    return shares
