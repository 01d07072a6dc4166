"""Joint motions around the home posture that show friction at all speeds, within the limits."""

from __future__ import annotations

import dataclasses

import numpy as np
from scipy.interpolate import CubicSpline

from kendama_cli.artifacts.motion_plan import JointTrajectory
from kendama_cli.errors import StageError
from kendama_cli.motion import minimum_jerk
from kendama_cli.plugins.identification.settings import IdentifySettings
from kendama_cli.robot_model.model import RobotModel
from kendama_cli.robot_model.placement.clearance import min_clearance
from kendama_cli.robot_model.placement.motion_check import limit_ratios
from kendama_cli.schema.arrays import Array
from kendama_cli.settings.game import GameSettings

RAMP_S = 1.0
"""The motion grows from rest at home, and comes to rest there again, in so long."""
MARGIN = 1.02
EFFORT_SHARE, TRIES = 0.8, 8
CAPSULE_SLACK_M = 0.03
"""The capsules about the links are wider than these by so much in places."""
FASTEST_HZ = 2.0
"""Fundamental of the fastest joint: quicker shaking tells more of the links' elasticity than of friction."""


def excitation(
    arm: RobotModel,
    game: GameSettings,
    settings: IdentifySettings,
    *,
    duration_s: float,
    period_s: float,
    rng: np.random.Generator,
) -> JointTrajectory:
    """Return a motion of all joints at once, sampled every ``period_s``; ``rng`` samples its amplitudes and phases.

    q = q0 + A w(t) sum_k c_k sin(k omega phi(t) + p_k),   phi' = s^((1 + cos(2 pi m t / T)) / 2)

    with q0 the posture nearest to home that leaves room, the sum scaled to 1, w a window that begins and ends at rest,
    and m sweeps of the time scale from the share s, at which the joint's peak speed is ``min_speed_rad_s``, to 1. Each
    joint's omega is the maximum within ``limit_ratio`` of its limits; where the arm's weight and inertia would ask for
    more than EFFORT_SHARE of an effort limit, all are slower. Raises StageError, naming the joint, where its range is
    less than 2 A, where even slowly the effort is too large, or where links would touch.
    """
    center = _middle(arm, settings.amplitude_rad)
    state = rng.bit_generator.state
    fraction = settings.limit_ratio
    for _ in range(TRIES):
        rng.bit_generator.state = state
        joints = _motion(
            arm,
            center,
            dataclasses.replace(settings, limit_ratio=fraction),
            duration_s=duration_s,
            period_s=period_s,
            rng=rng,
        )
        effort = limit_ratios(arm, joints).effort
        overlap = _overlap(arm, game, joints) if effort.max() <= EFFORT_SHARE else ""
        if effort.max() <= EFFORT_SHARE and not overlap:
            return joints
        fraction /= 1.5
    name = arm.joint_names[int(effort.argmax())]
    raise StageError(
        overlap
        or f"joint '{name}' of {arm.settings.name} would need {effort.max():.2f} of its effort limit even for slow "
        f"motions around home; allowed: {EFFORT_SHARE}: lower identify.amplitude_rad or choose another robot.home_rad"
    )


def _motion(
    arm: RobotModel,
    middle_rad: Array,
    settings: IdentifySettings,
    *,
    duration_s: float,
    period_s: float,
    rng: np.random.Generator,
) -> JointTrajectory:
    n = len(arm.joint_names)
    k = np.arange(1, settings.harmonics + 1)
    t_s = np.arange(round(duration_s / period_s) + 1, dtype=np.float64) * period_s
    exponent = 0.5 * (1 + np.cos(2 * np.pi * settings.sweeps * t_s / t_s[-1]))
    wave = np.empty((len(t_s), n))
    for j in range(n):
        size, start = rng.uniform(0.3, 1.0, k.size) / k, rng.uniform(0.0, 2 * np.pi, k.size)
        circle = np.linspace(0, 2 * np.pi, 2048)[:, None] * k + start
        size = size / np.abs((size * np.sin(circle)).sum(axis=1)).max()
        speed = settings.amplitude_rad * np.abs((size * k * np.cos(circle)).sum(axis=1)).max()
        change = settings.amplitude_rad * np.abs((size * k**2 * np.sin(circle)).sum(axis=1)).max()
        omega = min(
            settings.limit_ratio * arm.limits.velocity_rad_s[j] / speed,
            float(np.sqrt(settings.limit_ratio * arm.limits.acceleration_rad_s2[j] / change)),
            2 * np.pi * FASTEST_HZ,
        )
        slowest = min(settings.min_speed_rad_s / (omega * speed), 1.0)
        phase_s = CubicSpline(t_s, slowest**exponent).antiderivative()(t_s)
        wave[:, j] = (size * np.sin(phase_s[:, None] * k * omega + start)).sum(axis=1)
    window = minimum_jerk.step(t_s / RAMP_S) * minimum_jerk.step((t_s[-1] - t_s) / RAMP_S)
    angles = middle_rad + settings.amplitude_rad * window[:, None] * wave
    curve = CubicSpline(t_s, angles)
    return JointTrajectory(arm.joint_names, t_s, angles, curve(t_s, 1), curve(t_s, 2))


def _middle(arm: RobotModel, amplitude_rad: float) -> Array:
    """Return the posture nearest to home about which every joint can move by ``amplitude_rad`` in both directions."""
    reach = MARGIN * amplitude_rad
    for name, low, high in zip(arm.joint_names, arm.limits.lower_rad, arm.limits.upper_rad, strict=True):
        if high - low < 2 * reach:
            raise StageError(
                f"joint '{name}' of {arm.settings.name} cannot be excited by {amplitude_rad} rad both ways; allowed: "
                f"{(high - low) / 2 / MARGIN:.3f} rad, for its range is {low:.3f} to {high:.3f} rad: "
                "lower identify.amplitude_rad"
            )
    return np.clip(arm.home_rad, arm.limits.lower_rad + reach, arm.limits.upper_rad - reach)


def _overlap(arm: RobotModel, game: GameSettings, joints: JointTrajectory) -> str:
    """Return the parts that overlap by more than at home, beyond the coarseness of their capsules; empty if none do."""
    rest = np.zeros((2, len(arm.home_rad)))
    home = JointTrajectory(arm.joint_names, np.array([0.0, 1.0]), np.tile(arm.home_rad, (2, 1)), rest, rest)
    allowed_m = min(min_clearance(arm, game, home, swing_rad=None).gap_m, 0.0) - CAPSULE_SLACK_M
    nearest = min_clearance(arm, game, joints, swing_rad=None)
    if nearest.gap_m >= allowed_m:
        return ""
    return (
        f"{nearest.parts} of {arm.settings.name} would overlap by {-1e3 * nearest.gap_m:.0f} mm in the exciting "
        f"motion; allowed: {-1e3 * allowed_m:.0f} mm of their capsules: lower identify.amplitude_rad or choose "
        "another robot.home_rad"
    )
