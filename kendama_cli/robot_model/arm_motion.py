"""The arm's motion for a primitive at any tau: solved once, then only stretched in time."""

from __future__ import annotations

import dataclasses

import numpy as np
from scipy.interpolate import CubicSpline

from kendama_cli.artifacts.motion_plan import JointTrajectory, MotionPlan
from kendama_cli.motion.dmp.heading import CupPath
from kendama_cli.motion.dmp.turning import cup_axes, rotations_of
from kendama_cli.robot_model.inverse_kinematics import follow_path
from kendama_cli.robot_model.model import RobotModel
from kendama_cli.schema.arrays import Array

KNOT_S = 0.004
"""Spacing of the solved postures; between them the spline is within 1e-7 rad."""
SAMPLE_S = 0.001
"""Spacing of a planned motion's samples; the simulated world takes one in each of its steps."""
CONTROL_S = 0.004
"""Time between two commands, as on the twin."""


class ArmMotion:
    """A primitive as a motion of the arm: rest, lead-in if the primitive begins moving, the primitive, its settling.

    ``cup_m`` is relative to home; everything scales with tau, for a primitive played tau times slower runs through
    the same places and tilts: q(t) = q1(t / tau), q' = q1' / tau, q'' = q1'' / tau^2.
    Raises StageError where the arm cannot follow.
    """

    def __init__(self, arm: RobotModel, plan: MotionPlan, lead_in_m_s2: float) -> None:
        self.arm = arm
        self.plan = plan
        self._path = CupPath(plan, lead_in_m_s2)
        self._inner = dataclasses.replace(plan, tau_scale=1.0)
        self.lead_in_s = self._path.lead_in_s
        self._t_s: Array = KNOT_S * np.arange(int(np.ceil(self._path.duration_s / KNOT_S)) + 1, dtype=np.float64)
        self.cup_m = self._path.at(self._t_s)
        home = arm.tool_position_m(arm.home_rad)
        axes = None if plan.turn is None else cup_axes(rotations_of(self._inner, self._t_s - self.lead_in_s))
        to_start = None if axes is None else cup_axes(_ramp(rotations_of(self._inner, np.zeros(1))[0]))
        start = follow_path(arm, home + _ramp(self.cup_m[0]), arm.home_rad, axes=to_start)[-1]
        self._curve = CubicSpline(self._t_s, follow_path(arm, home + self.cup_m, start, self._t_s, axes))
        self.home_m = home
        speed, change = np.abs(self._curve(self._t_s, 1)).max(axis=0), np.abs(self._curve(self._t_s, 2)).max(axis=0)
        self.velocity_ratios = speed / arm.limits.velocity_rad_s
        self.acceleration_ratios = change / arm.limits.acceleration_rad_s2

    def min_tau_scale(self) -> float:
        """Return the minimum tau_scale within the arm's velocity and acceleration limits."""
        return float(max(self.velocity_ratios.max(), np.sqrt(self.acceleration_ratios.max())))

    def limiting_joint(self) -> str:
        """Return the joint, and its limit in words, that forbids a faster motion."""
        arm, limits = self.arm, self.arm.limits
        if self.velocity_ratios.max() >= np.sqrt(self.acceleration_ratios.max()):
            j, kind = int(self.velocity_ratios.argmax()), "speed"
            limit = f"{limits.velocity_rad_s[j]:.2f} rad/s"
        else:
            j, kind = int(self.acceleration_ratios.argmax()), "acceleration"
            limit = f"{limits.acceleration_rad_s2[j]:.1f} rad/s^2"
        return f"joint '{arm.joint_names[j]}' with its {kind} limit of {limit}{arm.limit_doubt(kind)}"

    def joints(self, tau_scale: float, hold_s: float) -> JointTrajectory:
        """Return the motion at ``tau_scale``, every SAMPLE_S, followed by ``hold_s`` of settling and rest."""
        moving = (self.lead_in_s + self.plan.duration_s) * tau_scale
        t_s: Array = SAMPLE_S * np.arange(int(np.ceil((moving + hold_s) / SAMPLE_S)) + 1, dtype=np.float64)
        inner = t_s / tau_scale
        resting = (inner > self._t_s[-1])[:, None]
        inner = np.minimum(inner, self._t_s[-1])
        return JointTrajectory(
            self.arm.joint_names,
            t_s,
            self._curve(inner),
            np.where(resting, 0.0, self._curve(inner, 1) / tau_scale),
            np.where(resting, 0.0, self._curve(inner, 2) / tau_scale**2),
        )

    def cup_reference_m(self, tau_scale: float, t_s: Array) -> Array:
        """Return the tie point's reference position in the world (n, 3) at ``t_s`` (n,)."""
        return self.home_m + self._path.at(np.minimum(np.asarray(t_s) / tau_scale, self._t_s[-1]))


def _ramp(place: Array) -> Array:
    return np.linspace(0.0, 1.0, 20)[:, None] * place
