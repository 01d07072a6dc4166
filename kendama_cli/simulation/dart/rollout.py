"""One attempt at the catch: the arm plays a motion, the ball flies, and the miss is measured."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from kendama_cli.artifacts.motion_plan import JointTrajectory
from kendama_cli.physics.rim_crossing import (
    SLACK_S,
    at_rim_m,
    catch_from_s,
    falls,
    is_caught,
    over_rim,
    planned_descent,
)
from kendama_cli.schema.arrays import Array
from kendama_cli.simulation.dart.arm_errors import ArmErrors, ErringArm
from kendama_cli.simulation.dart.ball import TetheredBall
from kendama_cli.simulation.dart.world import STEP_S, ArmWorld


@dataclass(frozen=True)
class Descent:
    """The first descent of a flight through the rim's plane: from when to when the rope was slack, x and y there.

    ``forward_m`` is how far the ball flew along x until then, ``swing_slack_s`` the longest time for which the rope was
    slack before that flight.
    """

    flight_s: tuple[float, float]
    forward_m: float
    miss_m: tuple[float, float]
    swing_slack_s: float


class FlightRecord:
    """Watches ``ball`` step by step, from hanging still at time 0; the catch is planned from ``catch_from_s`` on.

    ``apex_m`` is the maximum height of its centre over the cup's position.
    """

    def __init__(self, ball: TetheredBall, catch_from_s: float = 0.0) -> None:
        self._ball, self._catch_from_s = ball, catch_from_s
        self._taut_s, self._taut_x_m, self._slack_steps, self._longest_s = 0.0, 0.0, 0, 0.0
        self._before: tuple[float, float, float] | None = None
        self._fallen = False
        self._descents: list[Descent] = []
        self.apex_m = -math.inf

    def observe(self, t_s: float) -> None:
        """Look at the ball after the step that ended at ``t_s``."""
        ball = self._ball
        apart = ball.position_m - ball.tie_m
        self.apex_m = max(self.apex_m, float(apart[2]))
        if ball.tension_n > 0.0:
            self._longest_s = max(self._longest_s, self._slack_steps * STEP_S)
            self._taut_s, self._slack_steps, self._before, self._fallen = t_s, 0, None, False
            self._taut_x_m = float(ball.position_m[0])
            return
        self._slack_steps += 1
        if self._fallen:
            return
        radius_m, before = ball.game.ball.radius_m, self._before
        self._before = now = over_rim(apart.tolist(), ball.axis.tolist(), ball.game.cup.rim_m)
        if before is None or not falls(before[2] - radius_m, now[2] - radius_m):
            return
        if t_s - self._taut_s >= SLACK_S - 0.5 * STEP_S:
            self._fallen = True
            forward_m = float(ball.position_m[0]) - self._taut_x_m
            self._descents.append(Descent((self._taut_s, t_s), forward_m, at_rim_m(before, now), self._longest_s))

    @property
    def descent(self) -> Descent | None:
        """The descent next to the planned catch; None where the ball never came down on a slack rope."""
        which = planned_descent([one.flight_s[1] for one in self._descents], self._catch_from_s)
        return None if which is None else self._descents[which]

    @property
    def swing_slack_s(self) -> float:
        """The longest time for which the rope was slack before the flight."""
        return self._longest_s if self.descent is None else self.descent.swing_slack_s

    @property
    def miss_m(self) -> tuple[float, float] | None:
        """The place (x, y) beside the cup's axis at which that descent reaches the rim's plane; None without one."""
        return None if self.descent is None else self.descent.miss_m

    @property
    def caught(self) -> bool:
        """Return True if the ball is in the cup and that descent led it there."""
        return is_caught(self._ball.is_in_cup(), self.miss_m, self._ball.game.cup.radius_m)


TRACE_EVERY = 10
"""Steps between two samples of a recorded rollout's swing."""

BEFORE_FLIGHT_S = 0.3
"""So long before the rope slackens for the flight the record goes on with every step: the last millimetres of a catch
can be repeated from it."""

PLANNED_EVERY = 20
"""Steps between two samples of the cup's planned path."""


@dataclass(frozen=True)
class Trace:
    """A rollout sampled at n instants: ``t_s`` (n,), places and the cup's unit axis (n, 3) in the world, joints.

    Every TRACE_EVERY steps, and every step from BEFORE_FLIGHT_S before the flight to the end.
    """

    t_s: Array
    cup_m: Array
    ball_m: Array
    cup_axis: Array
    position_rad: Array
    velocity_rad_s: Array
    effort_nm: Array

    @property
    def even(self) -> NDArray[np.int64]:
        """The samples (k,) that are TRACE_EVERY steps apart."""
        return np.flatnonzero(np.rint(self.t_s / STEP_S).astype(int) % TRACE_EVERY == 0)


class Correction(Protocol):
    """Correction of the planned commands by observations, renewed after every ``steps`` steps."""

    steps: int

    def coming(self, t_s: float, position_rad: Array, ball_m: Array) -> Sequence[tuple[Array, Array, Array]] | None:
        """Return positions, velocities, accelerations (n,) for the ends of the coming steps; None: as planned.

        The first of them begins at ``t_s``. ``position_rad`` (n,) are the angles as they are read then, ``ball_m`` (3,)
        is where the ball is.
        """


@dataclass(frozen=True)
class RolloutResult:
    """The outcome of a rollout.

    The ball is ``caught`` if it is in the cup at the end, and its descent next to the planned catch led it there: the
    first on a slack rope after CATCH_SHARE of the cup's planned path (rim_crossing). ``caught_later`` names what is in
    the cup otherwise. ``signed_miss_m`` is the ball's place along x beside the cup's axis as that descent reaches the
    rim's plane, None without one; ``side_miss_m`` is the same along y. ``flight_s`` is when the rope went slack for
    that flight and when it ended there, ``forward_m`` how far the ball flew along x in it; ``swing_slack_s`` is the
    longest time for which it was slack before. ``apex_m`` is the maximum height of the ball's centre over the rim. The
    shares are the peaks of speed and torque over their limits, ``effort_joint`` the joint whose torque came nearest to
    its own.
    """

    caught: bool
    caught_later: bool
    signed_miss_m: float | None
    side_miss_m: float | None
    flight_s: tuple[float, float] | None
    forward_m: float | None
    swing_slack_s: float
    apex_m: float
    velocity_ratio: float
    effort_ratio: float
    effort_joint: str
    trace: Trace | None


def play_rollout(
    world: ArmWorld,
    joints: JointTrajectory,
    *,
    errors: ArmErrors | None = None,
    noise_rad: float = 0.0,
    rng: np.random.Generator | None = None,
    correction: Correction | None = None,
    record: bool = False,
) -> RolloutResult:
    """Play ``joints``, sampled every STEP_S, from rest with the ball hanging; the world keeps its perturbation.

    The arm follows ``joints``, or what ``correction`` makes of them, with its ``errors``. ``noise_rad`` is the standard
    deviation of the angles read, sampled from ``rng``. Raises SimulationError.
    """
    world.reset(joints.position_rad[0])
    planned = list(zip(joints.position_rad, joints.velocity_rad_s, joints.acceleration_rad_s2, strict=True))
    noises = [0.0] * len(planned)
    erring = None if errors is None else ErringArm(world.arm, joints, errors, STEP_S, rng)
    if rng is not None and noise_rad > 0:
        noises = list(rng.normal(0.0, noise_rad, joints.position_rad.shape))
    flight = FlightRecord(world.ball, _catch_from_s(world, joints))
    corrected: Sequence[tuple[Array, Array, Array]] | None = None
    fastest = strongest = np.zeros(len(world.position_rad))
    samples: list[tuple[float | Array, ...]] = [_sample(world)] if record else []
    for k in range(1, len(planned)):
        position, speed, change = planned[k]
        reading_error: Array | float = noises[k]
        if correction is not None:
            ahead = (k - 1) % correction.steps
            if ahead == 0:
                read = reading_error if erring is None else reading_error + erring.encoder_error(k)
                corrected = correction.coming(world.t_s, world.position_rad + read, world.ball.position_m)
            if corrected is not None:
                position, speed, change = corrected[ahead]
        if erring is not None:
            position, speed, change = erring.follows(position, speed, change)
            reading_error = reading_error + erring.reading_error(k, change)
        world.step(position, speed, change, reading_error)
        flight.observe(world.t_s)
        fastest = np.maximum(fastest, np.abs(world.velocity_rad_s))
        strongest = np.maximum(strongest, np.abs(world.effort_nm))
        if record:
            samples.append(_sample(world))
    miss_m, side_m = flight.miss_m or (None, None)
    descent, efforts = flight.descent, strongest / world.arm.limits.effort_nm
    return RolloutResult(
        caught=flight.caught,
        caught_later=world.ball.is_in_cup() and not flight.caught,
        signed_miss_m=miss_m,
        side_miss_m=side_m,
        flight_s=None if descent is None else descent.flight_s,
        forward_m=None if descent is None else descent.forward_m,
        swing_slack_s=flight.swing_slack_s,
        apex_m=float(flight.apex_m - world.ball.game.cup.rim_m),
        velocity_ratio=float((fastest / world.arm.limits.velocity_rad_s).max()),
        effort_ratio=float(efforts.max()),
        effort_joint=world.arm.joint_names[int(efforts.argmax())],
        trace=_trace(samples, descent) if record else None,
    )


def _catch_from_s(world: ArmWorld, joints: JointTrajectory) -> float:
    """Return the earliest time of the planned catch."""
    t_s = joints.t_s[::PLANNED_EVERY] - joints.t_s[0]
    return catch_from_s(t_s, np.array([world.arm.tool_position_m(one) for one in joints.position_rad[::PLANNED_EVERY]]))


def _trace(samples: Sequence[tuple[float | Array, ...]], descent: Descent | None) -> Trace:
    every = len(samples) if descent is None else max(0, round((descent.flight_s[0] - BEFORE_FLIGHT_S) / STEP_S))
    kept = [one for k, one in enumerate(samples) if k >= every or k % TRACE_EVERY == 0]
    return Trace(*(np.array(column) for column in zip(*kept, strict=True)))


def _sample(world: ArmWorld) -> tuple[float | Array, ...]:
    """Return one row of a Trace."""
    joint_state = (world.position_rad, world.velocity_rad_s, world.effort_nm)
    return (world.t_s, world.ball.tie_m, world.ball.position_m, world.ball.axis, *joint_state)
