"""Cup as a cart on a line, which the policy accelerates, and its tilt off the line, for any arm."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from kendama_cli.control.lag import Lag
from kendama_cli.control.swing_state import SwingStateEstimator
from kendama_cli.devices.robot.interface import Exchange, JointCommand, Robot
from kendama_cli.learning.state import SwingState
from kendama_cli.motion.braking import BrakingLimiter
from kendama_cli.physics.taut_rope import TautRope, time_scale
from kendama_cli.robot_model.inverse_kinematics import OutOfReachError, solve_cup, weighted_step
from kendama_cli.robot_model.model import RobotModel
from kendama_cli.robot_model.placement.placement import CupLine
from kendama_cli.schema.arrays import Array
from kendama_cli.settings.game import GameSettings


@dataclass(frozen=True)
class CupTilt:
    """Lift of the cup over its line, its tilt from upright toward the line's direction, and their rates."""

    lift_m: float = 0.0
    lift_m_s: float = 0.0
    tilt_rad: float = 0.0
    tilt_rad_s: float = 0.0


class TiltingArm:
    """Joint commands for the cup on its line and tilted, each found from the one before.

    Speeds solve J q' = v with the arm's own weights, and accelerations are their differences. ``direction`` (3,) is
    the line's, ``center_m`` (3,) the tie point at x = 0.
    """

    def __init__(self, arm: RobotModel, center_m: Array, direction: Array, period_s: float) -> None:
        self._arm, self._center_m, self._direction, self._period_s = arm, center_m, direction, period_s

    def begin(self, position_rad: Array, velocity_rad_s: Array) -> None:
        """Continue from this command, with the cup on its line."""
        self._q, self._speed = np.array(position_rad), np.array(velocity_rad_s)

    def at(self, x_m: float, velocity_m_s: float, tilt: CupTilt) -> JointCommand | None:
        """Return the joints for the end of the coming period; None if they would leave their limits."""
        arm, along = self._arm, self._direction
        up = np.array([0.0, 0.0, 1.0])
        position = self._center_m + x_m * along + tilt.lift_m * up
        axis = math.sin(tilt.tilt_rad) * along + math.cos(tilt.tilt_rad) * up
        about = np.cross(up, along)
        spin_axes = np.array([about, np.cross(axis, about)])  # the cup may spin about its axis
        try:
            q = solve_cup(arm, position, self._q, spin_axes)
        except OutOfReachError:
            return None
        _, task = arm.cup_task(q, spin_axes)
        desired = np.concatenate([velocity_m_s * along + tilt.lift_m_s * up, [tilt.tilt_rad_s, 0.0]])
        speed = weighted_step(task, desired, arm.redundancy_weights)
        change_rad_s2 = (speed - self._speed) / self._period_s
        if not arm.limits.allow(q, speed, change_rad_s2).all():
            return None
        self._q, self._speed = q, speed
        return JointCommand(q, speed, change_rad_s2)


def predict_state(
    state: SwingState,
    reference: tuple[float, float],
    coming_m_s2: Sequence[float],
    *,
    period_s: float,
    rope: TautRope,
    gravity_m_s2: float,
) -> SwingState:
    """Return ``state`` after the accelerations ``coming_m_s2``, commanded but not yet carried out.

    The cup will be where its ``reference`` (position, velocity) is now. The ball swings on about the accelerated tie
    point with the rope taut (TautRope), by semi-implicit Euler with one step per control period.
    """
    angle, rate = state.angle_rad, state.rate_rad_s
    for a in coming_m_s2:
        rate += rope.acceleration_rad_s2(angle, rate, a, gravity_m_s2) * period_s
        angle += rate * period_s
    return SwingState(*reference, math.remainder(angle, 2.0 * math.pi), rate)


def scaled_to_model_rope(state: SwingState, rope_scale: float) -> SwingState:
    """Return the same swing on the model's rope, if the real one is ``rope_scale`` times as long.

    With lengths divided by s and times by sqrt(s) the equations of motion stay as they are under the same gravity
    and the same accelerations, so that what was learned on the one holds on the other.
    """
    root = time_scale(rope_scale)
    x, v, angle, rate = state
    return SwingState(x / rope_scale, v / root, angle, rate * root)


@dataclass(frozen=True)
class CartStep:
    """Control period: the desired acceleration, and the state after it; the cup was to tilt by ``tilt_rad``."""

    t_s: float
    state: SwingState
    acceleration_m_s2: float
    exchange: Exchange
    tilt_rad: float = 0.0


class CupCart:
    """Cart that integrates accelerations to a reference along ``line``, kept inside by a limiter; its swing's state.

    The limiter keeps the reference itself inside, which is exact: whatever lag or latency the arm has, the cup runs
    through positions of the reference before it, so that the limiter needs to know neither. The total delay
    ``delay_s``, the arm's and its tracking's, is estimated from the rollout itself: the slope of (reference - observed
    position) over the reference's velocity; ``arm_lag_s`` is the arm's part of it, by the same of the joints.
    """

    def __init__(
        self,
        robot: Robot,
        line: CupLine,
        estimator: SwingStateEstimator,
        game: GameSettings,
        rope_scale: float,
        *,
        tilting: TiltingArm | None = None,
    ) -> None:
        self.period_s = robot.period_s
        self.time_scale = time_scale(rope_scale)
        """Times on this rope over times on the model's."""
        self._rope_scale = rope_scale
        self._rope = TautRope.of(game, rope_scale)
        self._gravity_m_s2 = game.gravity_m_s2
        self._robot = robot
        self._line, self._tilting = line, tilting
        self._estimator = estimator
        self._clear(0.0)

    def begin(self, seed: int, x_m: float = 0.0) -> CartStep:
        """Come to rest at ``x_m`` with the ball hanging, and return the state there."""
        self._clear(x_m)
        self._estimator.begin()
        exchange = self._robot.reset(self._line.at(x_m, 0.0, 0.0).position_rad, seed)
        self._start_s = exchange.t_s
        return CartStep(0.0, self._estimator.update(exchange.state, 0.0), 0.0, exchange)

    def step(self, acceleration_m_s2: float, limiter: BrakingLimiter, tilt: CupTilt | None = None) -> CartStep:
        """Move for one control period under the acceleration nearest to the desired one that ``limiter`` allows.

        With a ``tilt`` the cup leaves its line, from the first one on as far as the joints' limits allow.
        """
        h = self.period_s
        a = limiter.limit(acceleration_m_s2, self.x_m, self.velocity_m_s)
        self.x_m += self.velocity_m_s * h + 0.5 * a * h * h
        self.velocity_m_s += a * h
        command = self._command(a, tilt)
        exchange = self._robot.exchange(command)
        self._arm_lag.observe(command.position_rad, command.velocity_rad_s, exchange.state.position_rad)
        self._sent.append(a)
        late = self._late
        state = self._estimator.update(exchange.state, self._sent[-1 - late] if late < len(self._sent) else 0.0)
        self.t_s = exchange.t_s - self._start_s
        self._delay.observe(self.x_m, self.velocity_m_s, state.x_m)
        return CartStep(self.t_s, state, a, exchange, 0.0 if tilt is None else tilt.tilt_rad)

    def _command(self, acceleration_m_s2: float, tilt: CupTilt | None) -> JointCommand:
        point = self._line.at(self.x_m, self.velocity_m_s, acceleration_m_s2)
        on_line = JointCommand(point.position_rad, point.velocity_rad_s, point.acceleration_rad_s2)
        if self._tilting is None:
            return on_line
        if tilt is None:
            self._tilting.begin(on_line.position_rad, on_line.velocity_rad_s)
            return on_line
        return self._tilting.at(self.x_m, self.velocity_m_s, tilt) or on_line

    @property
    def arm_lag_s(self) -> float:
        """Delay of the joints behind their commands [s]."""
        return self._arm_lag.lag_s

    @property
    def delay_s(self) -> float:
        """Delay of the tracked cup behind the reference [s]."""
        return self._delay.lag_s

    @property
    def _late(self) -> int:
        """Delay in control periods: so many of the newest commands have not been carried out yet."""
        return round(self.delay_s / self.period_s)

    def predict_state(self, state: SwingState) -> SwingState:
        """Return the state in which the next command will act, on the model's rope; ``state`` is the newest reading."""
        late = self._late
        coming = predict_state(
            state,
            (self.x_m, self.velocity_m_s),
            self._sent[-late:] if late else (),
            period_s=self.period_s,
            rope=self._rope,
            gravity_m_s2=self._gravity_m_s2,
        )
        return scaled_to_model_rope(coming, self._rope_scale)

    def _clear(self, x_m: float) -> None:
        self.x_m = x_m
        self.velocity_m_s = 0.0
        self.t_s = 0.0
        self._start_s = 0.0
        self._delay: Lag = Lag()
        self._arm_lag: Lag = Lag()
        self._sent: list[float] = []
