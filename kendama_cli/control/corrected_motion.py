"""Planned motion of the joints whose cup is moved, while the ball flies, to where the ball is seen to come down."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from kendama_cli.adaptation.settings import CorrectionSettings
from kendama_cli.artifacts.catch_pose import CatchPose
from kendama_cli.artifacts.motion_plan import JointTrajectory
from kendama_cli.control.contact_lift import ContactLift
from kendama_cli.control.interception import InterceptionPlan, plan_interception
from kendama_cli.control.lag import Lag
from kendama_cli.devices.robot.interface import JointCommand
from kendama_cli.robot_model.inverse_kinematics import across, weighted_step
from kendama_cli.robot_model.model import UPRIGHT, RobotModel
from kendama_cli.schema.arrays import Array

ROUNDING_M = 1e-5
"""The last period of braking is not a whole one: it ends up to b h^2 / 8 farther."""


def shortened(vector: Array, most: float) -> Array:
    """Return ``vector`` at its length, or at ``most``."""
    return np.asarray(vector * min(1.0, most / max(float(np.linalg.norm(vector)), 1e-12)))


def bounded(
    acceleration_m_s2: Array, shift_m: Array, speed_m_s: Array, h: float, settings: CorrectionSettings
) -> Array:
    """Return ``acceleration_m_s2`` (2,) for a period of ``h``, or braking where it would lead out of the circle.

    From s (2,) with speed v the cup stops at s + v |v| / (2 b), which braking with b = ``settings.braking_m_s2``
    leaves unchanged. That position has to be within ``settings.max_shift_m`` of the plan.
    """
    shift = shift_m + h * (speed_m_s + 0.5 * h * acceleration_m_s2)
    if _stops_inside(shift, speed_m_s + h * acceleration_m_s2, settings):
        return acceleration_m_s2
    inside = _stops_inside(shift_m, speed_m_s, settings)
    return shortened(-speed_m_s / h, settings.braking_m_s2 if inside else settings.acceleration_m_s2)


def brakable(speed_m_s: Array, shift_m: Array, settings: CorrectionSettings) -> Array:
    """Return ``speed_m_s`` (2,), or as much of it as can be braked in the circle from ``shift_m`` (2,) on.

    v^2 = 2 b d with d the distance along the velocity to the circle.
    """
    out_m = float(shift_m @ speed_m_s) / max(float(np.linalg.norm(speed_m_s)), 1e-12)
    left_m = math.sqrt(max(out_m**2 + settings.max_shift_m**2 - float(shift_m @ shift_m), 0.0)) - out_m
    return shortened(speed_m_s, math.sqrt(2 * settings.braking_m_s2 * max(left_m, 0.0)))


def _stops_inside(shift_m: Array, speed_m_s: Array, settings: CorrectionSettings) -> bool:
    displacement_m = speed_m_s * float(np.linalg.norm(speed_m_s)) / (2 * settings.braking_m_s2)
    return float(np.linalg.norm(shift_m + displacement_m)) <= settings.max_shift_m + ROUNDING_M


FRACTIONS = (1.0, 0.6, 0.3, 0.0)
"""Fractions of the desired acceleration: the first with which every joint keeps its limits, else the shift stops."""
UNREACHED_M = 0.005
"""A cup that the arm cannot bring nearer than this to its position is out of reach."""
STILL_M_S = 1e-12


@dataclass(frozen=True)
class PlannedCup:
    """Planned cup at one instant: tie point (3,), axis (3,), the frame across it (2, 3), the task's speed (5,)."""

    position_m: Array
    axis: Array
    across: Array
    task_speed: Array


class CupPlan:
    """Planned cup of ``motion``, sampled every ``period_s``, each sample solved when it is asked for."""

    def __init__(self, arm: RobotModel, motion: JointTrajectory, period_s: float) -> None:
        self.arm, self.motion, self.period_s = arm, motion, period_s
        self._known: dict[int, PlannedCup] = {}

    def sample(self, index: int) -> PlannedCup:
        """Return the cup at sample ``index``; the last one is held."""
        index = min(max(index, 0), len(self.motion.t_s) - 1)
        if index not in self._known:
            q, speed = self.motion.position_rad[index], self.motion.velocity_rad_s[index]
            pose = self.arm.tool_pose(q)
            axis = pose.rotation[:, 2]
            about = UPRIGHT if axis[2] > 1.0 - 1e-12 else across(axis)
            _, task = self.arm.cup_task(q, about)
            self._known[index] = PlannedCup(pose.position_m, axis, about, task @ speed)
        return self._known[index]

    def at(self, t_s: float, lever_m: float) -> tuple[Array, Array]:
        """Return position and velocity (3,) of the point ``lever_m`` over the tie point at ``t_s`` from the start."""
        index = math.floor(t_s / self.period_s)
        one, two = self.sample(index), self.sample(index + 1)
        part = t_s / self.period_s - index
        axis = one.axis + part * (two.axis - one.axis)
        position = one.position_m + part * (two.position_m - one.position_m) + lever_m * axis
        return position, one.task_speed[:3] + part * (two.task_speed[:3] - one.task_speed[:3])


_Tried = tuple[JointCommand, bool, Array, Array, tuple[float, float]]


class CorrectedMotion:
    """Commands for the samples of a ``plan``, and beside them once a catch is foreseen.

    The cup's shift along x and y is the cubic of plan_interception, planned anew in every period, that brings the cup
    to the ball at the catch, less the drive's lag, with the ball's own speed as far as the limits
    allow. It never leaves a circle of ``settings.max_shift_m`` about the plan: the cup brakes in time. Its height is
    that of ContactLift. Every command keeps to the joints' limits as far as braking does: accelerations are reduced.

    No ball is followed before ``from_s``, counted from the motion's start.
    """

    def __init__(self, plan: CupPlan, settings: CorrectionSettings, rim_m: float, from_s: float = 0.0) -> None:
        self._plan, self._settings, self._from_s = plan, settings, from_s
        self._lever_m = rim_m - settings.below_rim_m
        motion = plan.motion
        self._index = 0
        self._last = JointCommand(motion.position_rad[0], motion.velocity_rad_s[0], motion.acceleration_rad_s2[0])
        self._shift_m, self._speed_m_s = np.zeros(2), np.zeros(2)
        self._lift = (0.0, 0.0)  # height over the plan and its rate
        self._contact = ContactLift(settings, plan.period_s)
        self.catch_shift_m = self.max_shift_m = 0.0
        self._pose: CatchPose | None = None
        self._catch_s = math.inf
        self._plans: list[InterceptionPlan] = []
        self._lag = Lag()

    @property
    def last(self) -> JointCommand:
        """Command that was given last."""
        return self._last

    @property
    def corrected(self) -> bool:
        """True if a catch is foreseen."""
        return self._pose is not None

    @property
    def shift_m(self) -> Array:
        """Displacement (2,) of the commanded cup from the planned one.

        ``catch_shift_m`` is its length at the catch, ``max_shift_m`` the largest until now.
        """
        return self._shift_m

    @property
    def lag_s(self) -> float:
        """Delay of the joints behind their commands [s]."""
        return self._lag.lag_s

    def observe(self, position_rad: Array) -> None:
        """Take the joints (n,) as they are read after the last command; in flight the lag is known already."""
        if self._pose is None:
            self._lag.observe(self._last.position_rad, self._last.velocity_rad_s, position_rad)

    def follow(self, pose: CatchPose) -> None:
        """Aim at the ball of ``pose``, on its descent at any height, if it is known well enough.

        Its time counts from the motion's start.
        """
        believed = float(np.trace(pose.covariance_m2)) <= self._settings.max_sigma_m**2
        if believed and self._index * self._plan.period_s >= self._from_s:
            self._pose = pose

    def next(self) -> JointCommand:
        """Return the command for the end of the coming period."""
        self._index += 1
        k = min(self._index, len(self._plan.motion.t_s) - 1)
        motion = self._plan.motion
        if self._pose is None:
            self._last = JointCommand(motion.position_rad[k], motion.velocity_rad_s[k], motion.acceleration_rad_s2[k])
        elif self._speed_m_s.any() or not self.over or self._last.velocity_rad_s.any():
            h, settings = self._plan.period_s, self._settings
            desired = bounded(self._acceleration_m_s2(self._pose), self._shift_m, self._speed_m_s, h, settings)
            rising = self._contact.acceleration_m_s2(*self._lift, (self._index - 1) * h, self._catch_s)
            stopping = shortened(-self._speed_m_s / h, settings.acceleration_m_s2)
            falling = min(max(-self._lift[1] / h, -settings.acceleration_m_s2), settings.acceleration_m_s2)
            for tried in (*((part * desired, part * rising) for part in FRACTIONS), (stopping, falling)):
                made = self._with_acceleration(*tried, k)
                if made[1]:
                    break
            self._last, _, self._shift_m, speed_m_s, self._lift = made
            self._speed_m_s = np.where(np.abs(speed_m_s) < STILL_M_S, 0.0, speed_m_s)
            shift_m = float(np.linalg.norm(self._shift_m))
            self.max_shift_m = max(self.max_shift_m, shift_m)
            if not self.over:
                self.catch_shift_m = shift_m
        return self._last

    @property
    def over(self) -> bool:
        """True if the time of the catch has passed: nothing that is seen from then on counts."""
        return self._index * self._plan.period_s >= self._catch_s

    def _acceleration_m_s2(self, pose: CatchPose) -> Array:
        """Return the acceleration of the shift (2,) in the coming period."""
        settings, h = self._settings, self._plan.period_s
        start_s = (self._index - 1) * h
        if start_s < self._catch_s - settings.freeze_before_catch_s:
            self._aim(pose, start_s)
        if start_s < self._catch_s:
            desired = np.array([plan.acceleration_m_s2(start_s + 0.5 * h) for plan in self._plans])
            return shortened(desired, settings.acceleration_m_s2)
        return shortened(-self._speed_m_s / h, settings.braking_m_s2)

    def _aim(self, pose: CatchPose, start_s: float) -> None:
        """Plan the shift from ``start_s`` on, where there is time for another plan."""
        settings = self._settings
        falls_s = self._falls_s(pose)
        end_s = pose.t_s + falls_s - self.lag_s
        if end_s - start_s < settings.freeze_before_catch_s:
            if not self._plans:
                self._catch_s = start_s
            return
        self._catch_s = end_s
        cup_m, cup_m_s = self._plan.at(end_s, self._lever_m)
        aim_m = shortened((pose.position_m + falls_s * pose.velocity_m_s - cup_m)[:2], settings.max_shift_m)
        displacement_m = aim_m - self._shift_m
        desired_m_s = brakable(settings.matching * (pose.velocity_m_s - cup_m_s)[:2], aim_m, settings)
        self._plans = [
            plan_interception(
                displacement_m=float(displacement_m[axis]),
                velocity_m_s=float(self._speed_m_s[axis]),
                desired_m_s=float(desired_m_s[axis]),
                start_s=start_s,
                end_s=end_s,
                limit_m_s2=settings.acceleration_m_s2,
            )
            for axis in range(2)
        ]

    def _falls_s(self, pose: CatchPose) -> float:
        """Return how long after ``pose`` the ball comes down to the planned cup's height [s]."""
        s, g = 0.0, self._plan.arm.gravity_m_s2
        for _ in range(4):
            cup_m, cup_m_s = self._plan.at(pose.t_s + s - self.lag_s, self._lever_m)
            above_m = pose.position_m[2] + s * pose.velocity_m_s[2] - 0.5 * s * s * g - cup_m[2]
            s -= float(above_m) / min(float(pose.velocity_m_s[2] - s * g - cup_m_s[2]), -0.2)
        return s

    def _with_acceleration(self, acceleration_m_s2: Array, rising_m_s2: float, k: int) -> _Tried:
        """Return the command, True if the joints' limits allow it, the shift and its velocity, and the lift."""
        h, (lift, rise) = self._plan.period_s, self._lift
        shift = self._shift_m + h * (self._speed_m_s + 0.5 * h * acceleration_m_s2)
        rate = self._speed_m_s + h * acceleration_m_s2
        lifted = lift + h * (rise + 0.5 * h * rising_m_s2), rise + h * rising_m_s2
        state = np.append(shift, lifted[0]), np.append(rate, lifted[1])
        return *_beside(self._plan, k, *state, self._last), shift, rate, lifted


def _beside(plan: CupPlan, k: int, shift_m: Array, rate_m_s: Array, last: JointCommand) -> tuple[JointCommand, bool]:
    """Return the command after ``last`` with the cup ``shift_m`` (3,) beside sample ``k``; True if limits allow it."""
    arm, limits, h = plan.arm, plan.arm.limits, plan.period_s
    cup, planned_rad_s = plan.sample(k), plan.motion.velocity_rad_s[k]
    near = last.position_rad + h * last.velocity_rad_s
    value, task = arm.cup_task(near, cup.across)
    change = np.concatenate([cup.position_m - value[:3], value[3:]])
    change[:3] += shift_m
    most_rad = h * limits.velocity_rad_s  # a task that cannot be met asks for any step at all
    q = near + np.clip(weighted_step(task, change, arm.redundancy_weights), -most_rad, most_rad)
    desired = cup.task_speed + np.concatenate([rate_m_s, np.zeros(2)])
    speed = planned_rad_s + weighted_step(task, desired - task @ planned_rad_s, arm.redundancy_weights)
    bend = (speed - last.velocity_rad_s) / h
    inside = limits.allow(q, speed, bend)
    reached = float(np.abs(change).max()) < UNREACHED_M
    q = np.clip(q, limits.lower_rad, limits.upper_rad)
    speed = np.clip(speed, -limits.velocity_rad_s, limits.velocity_rad_s)
    return JointCommand(q, speed, bend), bool(inside.all()) and reached
