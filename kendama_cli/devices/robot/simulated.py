"""The arm in DART behind the robot's interface, perfect or perturbed."""

from __future__ import annotations

import dataclasses
import math

import numpy as np

from kendama_cli.devices.robot.interface import Exchange, JointCommand, RobotState, SceneState
from kendama_cli.devices.robot.limiter import ABSURD_RAD, check_command, check_values, nearest_command
from kendama_cli.errors import HardwareError
from kendama_cli.motion.even_spline import cubic_between
from kendama_cli.schema.arrays import Array
from kendama_cli.settings.game import GameSettings
from kendama_cli.settings.robot import Imperfection, RobotSettings
from kendama_cli.simulation.dart.arm_errors import Backlash, DriveDelay, Reference, WorldErrors
from kendama_cli.simulation.dart.world import STEP_S, ArmWorld


class ImperfectTracking:
    """Tracking of k markers at (k, 3) with errors sampled from ``rng``, one reading every ``period_s``.

    To white noise comes an error of the same size at all times that decays over ``drift_s``:

        e' = a e + sqrt(1 - a^2) drift_m n,   a = exp(-period_s / drift_s), n standard normal

    Then the reading comes ``tracking_delay_s`` late, or, where it is lost, the one before it again.
    """

    def __init__(self, errors: Imperfection, period_s: float, rng: np.random.Generator) -> None:
        self._errors, self._rng = errors, rng
        self._keep = math.exp(-period_s / errors.drift_s)
        self._late = round(errors.tracking_delay_s / period_s)
        self._drift: Array | None = None
        self._waiting: list[Array] = []

    def tracked(self, positions_m: Array) -> Array:
        """Return the tracked positions (k, 3) of markers at ``positions_m`` (k, 3)."""
        made, rng = self._errors, self._rng
        if made.ball_noise_m > 0:
            positions_m = positions_m + rng.normal(0.0, made.ball_noise_m, positions_m.shape)
        if made.drift_m > 0:
            new = rng.normal(0.0, made.drift_m, positions_m.shape)
            self._drift = new if self._drift is None else self._keep * self._drift + math.sqrt(1 - self._keep**2) * new
            positions_m = positions_m + self._drift
        lost = made.tracking_lost_fraction > 0 and rng.uniform() < made.tracking_lost_fraction
        self._waiting.append(self._waiting[-1] if lost and self._waiting else positions_m)
        del self._waiting[: -self._late - 1]
        return self._waiting[0]


def true_scene(world: ArmWorld) -> SceneState:
    """Return the true joints, cup and ball of a game."""
    pose = world.body.cup.getWorldTransform()
    return SceneState(
        np.array(world.position_rad),
        np.array(world.ball.tie_m),
        np.array(pose.rotation()),
        np.array(world.ball.position_m),
    )


def path_between(last: JointCommand, sent: JointCommand, *, steps: int, step_s: float) -> list[Reference]:
    """Return the reference at the end of every step: the cubic through both commands, the added torque on a line."""
    path = cubic_between(
        (last.position_rad, last.velocity_rad_s), (sent.position_rad, sent.velocity_rad_s), steps=steps, step_s=step_s
    )
    fraction = np.arange(1, steps + 1)[:, None] / steps
    return list(zip(*path, last.effort_nm + fraction * (sent.effort_nm - last.effort_nm), strict=True))


class SimulatedRobot:
    """A robot (see devices.robot.interface) that lives in DART.

    ``exchange`` runs ``control_period_s`` of 1 ms steps along the cubic between the last command and this one, after
    the limits; with an ``imperfection`` the reference arrives late and lagging, readings are noisy, and rope and
    friction differ from the controller's model.
    """

    def __init__(
        self,
        robot: RobotSettings,
        game: GameSettings,
        *,
        imperfection: Imperfection | None,
        control_period_s: float,
    ) -> None:
        self._world = ArmWorld(robot, game)
        arm = self._world.arm
        self.joint_names = arm.joint_names
        self.limits = arm.limits
        self._steps = max(1, round(control_period_s / STEP_S))
        self.period_s = self._steps * STEP_S
        self._imperfection = imperfection
        self.realtime = False
        self.missed = 0
        self._halted = False
        self.reset(arm.home_rad, 0)

    def reset(self, position_rad: Array, seed: int) -> Exchange:
        """Rest in ``position_rad`` (n,), the ball hanging still, time 0; all noise is sampled from ``seed``."""
        self._refuse_when_halted()
        self._rng = np.random.default_rng(seed)
        errors, latency_s, lag_s, self._joint_noise = WorldErrors(), 0.0, 0.0, 0.0
        self._tracking: ImperfectTracking | None = None
        self._backlash: Backlash | None = None
        if self._imperfection is not None:
            made = self._imperfection
            errors = _drawn(made, self._rng)
            latency_s, lag_s = made.latency_s, made.lag_s
            self._joint_noise = made.joint_noise_rad
            self._tracking = ImperfectTracking(made, self.period_s, self._rng)
        rest = np.zeros(len(self.joint_names))
        try:
            check_values("position_rad", position_rad, np.full_like(rest, ABSURD_RAD))
        except HardwareError:
            self.halt()
            raise
        start = np.clip(position_rad, self.limits.lower_rad, self.limits.upper_rad)
        if self._imperfection is not None and self._imperfection.backlash_rad > 0:
            self._backlash = Backlash(start, self._imperfection.backlash_rad)
        self._world.perturb(errors)
        self._world.reset(start)
        self._last = JointCommand(start, rest, rest)
        self._delay = DriveDelay((start, rest, rest, rest), latency_s=latency_s, lag_s=lag_s, step_s=STEP_S)
        return Exchange(self._last, self._state(), 0.0, true_scene(self._world))

    def exchange(self, command: JointCommand) -> Exchange:
        """Carry out one control period; raises HardwareError after ``halt`` or for a command that it refuses."""
        self._refuse_when_halted()
        try:
            check_command(command, self.limits)
        except HardwareError:
            self.halt()
            raise
        sent = nearest_command(self._last, command, self.limits, self.period_s)
        most = self.limits.effort_nm
        sent = dataclasses.replace(sent, effort_nm=np.clip(command.effort_nm, -most, most))
        for reference in path_between(self._last, sent, steps=self._steps, step_s=STEP_S):
            q, v, a, effort = self._delay.delayed(reference)
            if self._backlash is not None:
                q, v, a = self._backlash.follows(q, v, a)
            noise: Array | float = 0.0
            if self._joint_noise > 0:
                noise = self._rng.normal(0.0, self._joint_noise, len(self.joint_names))
            self._world.step(q, v, a, noise, effort)
        self._last = sent
        return Exchange(sent, self._state(), self._world.t_s, true_scene(self._world))

    def halt(self) -> None:
        """Stop and stay stopped."""
        self._halted = True

    def close(self) -> None:
        """Halt; there is no device to let go of."""
        self.halt()

    def _state(self) -> RobotState:
        world = self._world
        n = len(self.joint_names)
        angles = world.position_rad + (self._rng.normal(0.0, self._joint_noise, n) if self._joint_noise > 0 else 0.0)
        cup, ball = np.array(world.ball.tie_m), np.array(world.ball.position_m)
        caught = world.ball.is_in_cup()
        if self._tracking is not None:
            cup, ball = self._tracking.tracked(np.array([cup, ball]))
        if self._backlash is not None:
            angles = angles + self._backlash.gap_rad  # encoders sit on the motors
        wrench = world.wrist_wrench()
        return RobotState(angles, world.velocity_rad_s, world.effort_nm, wrench, cup, ball, caught)

    def _refuse_when_halted(self) -> None:
        if self._halted:
            raise HardwareError("the simulated robot is halted and stays so: open it anew")


def _drawn(made: Imperfection, rng: np.random.Generator) -> WorldErrors:
    """Sample the world of one reset."""
    return WorldErrors(
        rope_scale=made.rope_scale * (1 + made.rope_scale_spread * rng.uniform(-1, 1)),
        ball_start_m=made.ball_start_m * rng.uniform(-1, 1),
        joint_friction_nm=made.joint_friction_nm,
        joint_friction_fraction=made.joint_friction_fraction,
        mass_scale=made.mass_scale,
        drag_scale=made.drag_scale,
        tie_friction_m=made.tie_friction_m,
        gravity_tilt_rad=made.gravity_tilt_rad,
    )
