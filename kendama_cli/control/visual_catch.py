"""Visual catch in simulated rollouts: a sensor model of the cameras, which corrects the motion that is played."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Sequence

import numpy as np

from kendama_cli.adaptation.image_errors import EXACT, ImageErrors, SensorErrors
from kendama_cli.adaptation.settings import CorrectionSettings, SensorModelSettings
from kendama_cli.artifacts.motion_plan import JointTrajectory
from kendama_cli.control.corrected_motion import CorrectedMotion, CupPlan
from kendama_cli.control.position_tracker import PositionTracker, rope_angle_rad
from kendama_cli.motion.even_spline import cubic_between
from kendama_cli.robot_model.arm_motion import CONTROL_S
from kendama_cli.robot_model.model import RobotModel
from kendama_cli.schema.arrays import Array
from kendama_cli.settings.game import GameSettings


class VisualCatch:
    """Correction of ``joints`` by a visual catch: from the seen slackening of the rope on it moves their ``cup``.

    ``cup`` is their cup_plan. The ball's position is measured at the rate of the ``sensor``, at control periods, with
    noise sampled from ``rng`` and with ``errors``, and comes late; the joint angles are read at once.
    """

    def __init__(
        self,
        arm: RobotModel,
        game: GameSettings,
        joints: JointTrajectory,
        cup: CupPlan,
        *,
        sensor: SensorModelSettings,
        correction: CorrectionSettings,
        rng: np.random.Generator,
        errors: SensorErrors = EXACT,
    ) -> None:
        self._arm, self._sensor = arm, sensor
        self._images = ImageErrors(errors, np.array(sensor.sigma_m), rng)
        self._step_s = _step_s(joints)
        self.steps = round(cup.period_s / self._step_s)
        self._motion = CorrectedMotion(cup, correction, game.cup.rim_m)
        self._last = self._motion.last
        rim_m = float(arm.tool_position_m(joints.position_rad[-1])[2]) + game.cup.rim_m
        self._tracker = PositionTracker(sensor.onset, sensor.motion, game, rim_height_m=rim_m, sigma_m=sensor.sigma_m)
        self._from_rad, self._angle_rad = math.radians(sensor.observe_from_deg), 0.0
        self._frames = 0
        self._on_the_way: deque[tuple[float, Array]] = deque()
        self._ties: deque[tuple[float, Array]] = deque()

    @property
    def shifts_m(self) -> tuple[float, float]:
        """Distances of the cup from its plan: at the catch, and the largest."""
        return self._motion.catch_shift_m, self._motion.max_shift_m

    def coming(self, t_s: float, position_rad: Array, ball_m: Array) -> Sequence[tuple[Array, Array, Array]] | None:
        """Return the commands of the period that begins at ``t_s``, step by step; None: as planned."""
        motion, last = self._motion, self._last
        if t_s > 0.0:
            motion.observe(position_rad)
        if not motion.over:
            self._look(t_s, position_rad, ball_m)
        self._last = motion.next()
        if not motion.corrected:
            return None
        states = ((one.position_rad, one.velocity_rad_s) for one in (last, self._last))
        return list(zip(*cubic_between(*states, steps=self.steps, step_s=self._step_s), strict=True))

    def _look(self, t_s: float, position_rad: Array, ball_m: Array) -> None:
        tracker, sensor = self._tracker, self._sensor
        if t_s * sensor.rate_hz >= self._frames - 1e-9:
            self._frames += 1
            tie_m = self._arm.tool_position_m(position_rad)
            self._ties.append((t_s, tie_m))
            before, self._angle_rad = self._angle_rad, rope_angle_rad(ball_m - tie_m)
            rises = self._angle_rad >= max(before, self._from_rad)
            if rises or tracker.found is not None:
                self._on_the_way.append(self._images.image(t_s, ball_m))
            elif self._on_the_way or tracker.waits:
                self._on_the_way.clear()
                tracker.reset()
        while self._on_the_way and self._on_the_way[0][0] + sensor.latency_s <= t_s + 1e-9:
            stamp_s, seen_m = self._on_the_way.popleft()
            tracker.update(stamp_s, seen_m, self._tie_at(stamp_s))
            if tracker.found is not None and (pose := tracker.estimator.catch()) is not None:
                self._motion.follow(pose)

    def _tie_at(self, stamp_s: float) -> Array:
        """Return the tie point (3,) at ``stamp_s``, not before the last one asked for."""
        while len(self._ties) > 1 and self._ties[1][0] <= stamp_s:
            self._ties.popleft()
        (before_s, before_m), (after_s, after_m) = self._ties[0], self._ties[min(1, len(self._ties) - 1)]
        part = (stamp_s - before_s) / (after_s - before_s) if after_s > before_s else 0.0
        return np.asarray(before_m + min(part, 1.0) * (after_m - before_m))


def cup_plan(arm: RobotModel, joints: JointTrajectory) -> CupPlan:
    """Return the planned cup of ``joints`` at every control period."""
    every = round(CONTROL_S / _step_s(joints))
    columns = (joints.t_s, joints.position_rad, joints.velocity_rad_s, joints.acceleration_rad_s2)
    controlled = JointTrajectory(joints.joint_names, *(column[::every] for column in columns))
    return CupPlan(arm, controlled, every * _step_s(joints))


def _step_s(joints: JointTrajectory) -> float:
    return float(joints.t_s[1] - joints.t_s[0])
