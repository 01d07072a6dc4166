"""Check of a motion before an arm plays it, and the ratios of the joints' limits that a motion needs."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from kendama_cli.artifacts.motion_plan import JointTrajectory
from kendama_cli.errors import StageError
from kendama_cli.motion.sampling import thinning
from kendama_cli.robot_model.model import RobotModel
from kendama_cli.robot_model.placement.clearance import EVERY_S, FAR_M, min_clearance
from kendama_cli.schema.arrays import Array
from kendama_cli.settings.game import GameSettings
from kendama_cli.settings.safety import SafetySettings

SAMPLE_S = 0.004
"""Efforts are looked at this often."""

UNITS = {"speed": "rad/s", "acceleration": "rad/s^2", "effort": "Nm"}


@dataclass(frozen=True)
class Leading:
    """The joint that needs the maximum ``ratio`` of one kind of limit, and in words why that limit is in ``doubt``."""

    kind: str
    joint: str
    ratio: float
    limit: float
    doubt: str

    def __str__(self) -> str:
        limit = f"{self.limit:.2f} {UNITS[self.kind]}"
        return f"{self.ratio:.2f} of joint '{self.joint}' {self.kind} limit ({limit}){self.doubt}"


@dataclass(frozen=True)
class LimitRatios:
    """The peaks of a motion over the limits (n,), and how far each joint stays from its stops (n,) [rad].

    ``position`` is the distance from the centre of a joint's range over half the range.
    """

    joint_names: tuple[str, ...]
    position: Array
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
        """The leading joint of each kind of limit, the maximum ratio first."""
        found = []
        kinds = (self.velocity, self.acceleration, self.effort)
        for kind, fractions, limits, doubt in zip(UNITS, kinds, self.limits, self.doubts, strict=True):
            j = int(fractions.argmax())
            found.append(Leading(kind, self.joint_names[j], float(fractions[j]), float(limits[j]), doubt))
        return tuple(sorted(found, key=lambda one: -one.ratio))


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
    position = 1.0 - to_stop / ((arm.limits.upper_rad - arm.limits.lower_rad) / 2)
    return LimitRatios(arm.joint_names, position, speed, change, effort, to_stop, limits, doubts)


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
    fractions = limit_ratios(arm, joints)
    first = fractions.leading[0]
    if first.ratio > 1.0:
        unit = UNITS[first.kind]
        raise StageError(
            f"joint '{first.joint}' of {arm.settings.name} would need {first.ratio * first.limit:.2f} {unit}; "
            f"allowed: {first.limit:.2f} {unit}{first.doubt}: "
            "play the motion slower (adapt.tau_range) or place the arm otherwise (adapt.placement=search)"
        )
    return fractions


_ROUNDING = 1e-6
_CAPSULE_SLACK_M = 0.005
"""Capsules are wider than links; where two overlap at the start already, they may come so much nearer."""


@dataclass(frozen=True)
class CheckedLimit:
    """One limit, how near the motion comes to it, and whether that is allowed."""

    what: str
    found: str
    allowed: str
    holds: bool


def check_motion(
    arm: RobotModel, game: GameSettings, joints: JointTrajectory, safety: SafetySettings
) -> list[CheckedLimit]:
    """Check every limit of ``safety`` for ``joints``, but the ball's swing, which a first attempt does not have."""
    return [*_limits(arm, joints, safety), *check_places(arm, game, joints, safety)]


def check_places(
    arm: RobotModel, game: GameSettings, joints: JointTrajectory, safety: SafetySettings
) -> list[CheckedLimit]:
    """Return the limits of where ``joints`` go, however fast: stops, gaps, table and the cup's box."""
    own = [_stops(arm, joints, safety), _gap(arm, game, joints, safety)]
    return [*own, *_surroundings(arm, game, joints, safety)]


def require_allowed(checked: Iterable[CheckedLimit]) -> None:
    """Raise StageError that names all that is not allowed."""
    wrong = [f"{one.what}: {one.found}, allowed: {one.allowed}" for one in checked if not one.holds]
    if wrong:
        raise StageError(
            f"{'; '.join(wrong)}; nothing was moved: play it slower (adapt.tau_range), place the arm otherwise "
            "(kendama robot place), or set what the surroundings really allow (safety)"
        )


def _limits(arm: RobotModel, joints: JointTrajectory, safety: SafetySettings) -> list[CheckedLimit]:
    found = []
    for one in limit_ratios(arm, joints).leading:
        fraction = one.ratio if math.isfinite(one.ratio) else math.inf
        unit = UNITS[one.kind]
        needed = f"{fraction * one.limit:.2f} {unit} of joint '{one.joint}'"
        allowed = f"at most {safety.limit_ratio * one.limit:.2f} {unit}{one.doubt}"
        found.append(CheckedLimit(one.kind, needed, allowed, fraction <= safety.limit_ratio + _ROUNDING))
    return found


def _stops(arm: RobotModel, joints: JointTrajectory, safety: SafetySettings) -> CheckedLimit:
    left = arm.limits.to_stop_rad(joints.position_rad).min(axis=0)
    j = int(np.nan_to_num(left, nan=-math.inf).argmin())
    return CheckedLimit(
        "stop",
        f"{left[j]:.3f} rad to that of joint '{arm.joint_names[j]}'",
        f"at least {safety.to_stop_rad:.3f} rad",
        bool(left[j] >= safety.to_stop_rad - _ROUNDING),
    )


def _gap(arm: RobotModel, game: GameSettings, joints: JointTrajectory, safety: SafetySettings) -> CheckedLimit:
    """Check the gap between two parts of the arm; the table beneath it is another limit."""
    still = np.zeros_like(joints.position_rad[:2])
    start = JointTrajectory(joints.joint_names, joints.t_s[:2], joints.position_rad[[0, 0]], still, still)
    at_start, nearest = (min_clearance(arm, game, one, swing_rad=None, floor_m=-FAR_M) for one in (start, joints))
    overlap = at_start.gap_m < 0
    least_m = min(safety.gap_m, at_start.gap_m - _CAPSULE_SLACK_M) if overlap else safety.gap_m
    return CheckedLimit(
        "gap",
        f"{1e3 * nearest.gap_m:.0f} mm between {nearest.parts} at {nearest.t_s:.2f} s",
        f"at least {1e3 * least_m:.0f} mm" + (" (their capsules overlap at the start)" if overlap else ""),
        nearest.gap_m >= least_m - _ROUNDING,
    )


def _surroundings(
    arm: RobotModel, game: GameSettings, joints: JointTrajectory, safety: SafetySettings
) -> Iterable[CheckedLimit]:
    """Check the table beneath all but the pedestal and its link, and the box about the cup's tie point."""
    thin = thinning(joints.t_s, EVERY_S)
    rows = np.unique(np.append(np.arange(0, len(joints.t_s), thin), len(joints.t_s) - 1))
    angles = joints.position_rad[rows]
    heights = np.array([arm.joint_positions_m(one)[:, 2] for one in angles])
    cup_m = np.array([arm.tool_position_m(one) for one in angles])
    lowest = np.minimum(heights[:, 1:-1], heights[:, 2:]) - arm.link_radius_m[1:]
    gaps = np.column_stack([lowest, cup_m[:, 2] - game.cup.reach_m]) - safety.table_height_m
    k, part = np.unravel_index(gaps.argmin(), gaps.shape)
    names = [*(f"the link of '{name}'" for name in arm.joint_names[1:]), "the cup"]
    yield CheckedLimit(
        "table",
        f"{1e3 * gaps[k, part]:.0f} mm under {names[int(part)]} at {joints.t_s[rows[k]]:.2f} s",
        f"at least {1e3 * safety.gap_m:.0f} mm",
        bool(gaps[k, part] >= safety.gap_m - _ROUNDING),
    )
    for axis, name in enumerate("xyz"):
        low, high = float(cup_m[:, axis].min()), float(cup_m[:, axis].max())
        allowed = safety.cup_low_m[axis], safety.cup_high_m[axis]
        yield CheckedLimit(
            f"cup, {name}",
            f"from {low:.3f} to {high:.3f} m",
            f"from {allowed[0]:.3f} to {allowed[1]:.3f} m",
            bool(allowed[0] <= low and high <= allowed[1]),
        )
