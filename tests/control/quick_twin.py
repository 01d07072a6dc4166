"""A hard twin without its arm: the rail's compiled swing under the twin's errors, five times as quick."""

from __future__ import annotations

import dataclasses
import math
from collections import deque

import numpy as np

from kendama_cli.devices.robot.interface import Exchange, JointCommand, RobotState, SceneState
from kendama_cli.devices.robot.simulated import ImperfectTracking
from kendama_cli.robot_model.limits import JointLimits
from kendama_cli.schema.arrays import Array
from kendama_cli.settings.game import GameSettings
from kendama_cli.settings.robot import Imperfection
from kendama_cli.simulation.dart.rope_kernel import RUBS_FULLY_M_S
from kendama_cli.simulation.swingup import rail_kernel as kernel
from kendama_cli.simulation.swingup.rail import physics

STEP_S = 0.001
MIDDLE_M = np.array([0.6, 0.1, 0.8])


class QuickTwin:
    """The cup is a cart that follows its command with the twin's latency and lag; the ball swings in the plane.

    Of an Imperfection the rope, the ball's mass and start, air, tie friction, tilt of gravity, latency, lag and all of
    tracking are there; what an arm has (joint friction and noise, backlash) is not.
    """

    joint_names = ("x",)
    missed, realtime = 0, False

    def __init__(self, game: GameSettings, made: Imperfection, period_s: float = 0.004) -> None:
        ball = dataclasses.replace(game.ball, mass_kg=game.ball.mass_kg * made.mass_scale)
        self._game, self._made, self.period_s = dataclasses.replace(game, ball=ball), made, period_s
        self._physics = physics(self._game, STEP_S, made.rope_scale, made.drag_scale)
        self.limits = JointLimits(*(np.full(1, v) for v in (-0.5, 0.5, 3.0, 50.0, 100.0)))
        self._share = 1.0 if made.lag_s <= 0 else 1.0 - math.exp(-STEP_S / made.lag_s)
        self.reset(np.zeros(1), 0)

    def reset(self, position_rad: Array, seed: int) -> Exchange:
        rng, game, made = np.random.default_rng(seed), self._game, self._made
        x, length = float(position_rad[0]), self._physics.length_m
        aside = made.ball_start_m * rng.uniform(-1, 1) + length * math.sin(made.gravity_tilt_rad)
        hanging = length + game.ball.mass_kg * game.gravity_m_s2 / game.rope.stiffness_n_m
        self._swing = np.array([x, x + aside, -math.sqrt(hanging**2 - aside**2), 0.0, 0.0, 0.0, 0.0, 0.0])
        self._tracking = ImperfectTracking(made, self.period_s, rng)
        self._waiting = deque([0.0] * round(made.latency_s / STEP_S))
        self._lagging, self._caught, self._t_s = 0.0, False, 0.0
        return self._told(JointCommand(np.array([x]), np.zeros(1), np.zeros(1)))

    def exchange(self, command: JointCommand) -> Exchange:
        for _ in range(round(self.period_s / STEP_S)):
            self._waiting.append(float(command.acceleration_rad_s2[0]))
            self._lagging += self._share * (self._waiting.popleft() - self._lagging)
            self._step(self._lagging)
        self._t_s += self.period_s
        return self._told(command)

    def halt(self) -> None:
        pass

    def close(self) -> None:
        pass

    def _step(self, acceleration_m_s2: float) -> None:
        swing, game, made = self._swing, self._game, self._made
        before = swing[2]
        kernel.step(swing, acceleration_m_s2, self._physics)
        if self._caught:
            swing[1], swing[2], swing[4], swing[5] = swing[0], game.ball.radius_m, swing[3], 0.0
            return
        swing[4] += game.gravity_m_s2 * math.sin(made.gravity_tilt_rad) * STEP_S
        if made.tie_friction_m > 0.0:
            x, z, vx, vz = swing[1] - swing[0], swing[2], swing[4] - swing[3], swing[5]
            along = (x * vx + z * vz) / (x * x + z * z)
            vx, vz = vx - along * x, vz - along * z
            rub = made.tie_friction_m * math.hypot(swing[6], swing[7]) / self._physics.length_m
            slowed = rub / (math.hypot(vx, vz) + RUBS_FULLY_M_S) * STEP_S / game.ball.mass_kg
            swing[4], swing[5] = swing[4] - slowed * vx, swing[5] - slowed * vz
        if before >= game.cup.rim_m > swing[2]:
            self._caught = abs(swing[1] - swing[0]) < game.cup.radius_m - 0.5 * game.ball.radius_m

    def _told(self, sent: JointCommand) -> Exchange:
        x, ball_x, ball_z, speed = self._swing[:4].tolist()
        cup, ball = MIDDLE_M + np.array([[x, 0.0, 0.0], [ball_x, 0.0, ball_z]])
        place = np.array([x])
        seen = self._tracking.tracked(np.array([cup, ball]))
        state = RobotState(place, np.array([speed]), np.zeros(1), np.zeros(6), seen[0], seen[1], self._caught)
        return Exchange(sent, state, self._t_s, SceneState(place, cup, np.eye(3), ball))
