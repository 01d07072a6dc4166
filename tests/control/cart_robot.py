"""A robot whose one joint is the cup's place on a line, with the ball on its rope: quick, and without DART."""

from __future__ import annotations

import math

import numpy as np

from kendama_cli.devices.robot.interface import Exchange, JointCommand, RobotState, SceneState
from kendama_cli.physics.rope import RopeLaw, rope_pull
from kendama_cli.robot_model.limits import JointLimits
from kendama_cli.schema.arrays import Array
from kendama_cli.settings.game import GameSettings

STEP_S = 0.0005
MIDDLE_M = np.array([0.6, 0.1, 0.8])
DIRECTION = np.array([1.0, 0.0, 0.0])


class Straight:
    """The line of a robot whose joint is x itself."""

    def at(self, x_m: float, velocity_m_s: float, acceleration_m_s2: float) -> JointCommand:
        return JointCommand(np.array([x_m]), np.array([velocity_m_s]), np.array([acceleration_m_s2]))


class CartRobot:
    """Semi-implicit Euler for the ball (equations.md eq. 1); the cup follows its command with a pure delay.

    It is ``delay_n`` control periods; cup and ball are told ``tracking_late_n`` periods late.
    """

    joint_names = ("x",)

    def __init__(
        self,
        game: GameSettings,
        *,
        rope_scale: float = 1.0,
        delay_n: int = 0,
        noise_m: float = 0.0,
        tracking_late_n: int = 0,
    ) -> None:
        self.period_s = 0.004
        self.limits = JointLimits(*(np.full(1, v) for v in (-0.5, 0.5, 3.0, 50.0, 100.0)))
        self.game = game
        self.rope_m = game.rope.length_m * rope_scale
        self.law = RopeLaw.of(game, rope_scale)
        self.drag_per_s, self.drag_per_m = game.drag_per_mass
        self.delay_n = delay_n
        self.noise_m = noise_m
        self.tracking_late_n = tracking_late_n
        self.missed = 0
        self.realtime = False
        self.reset(np.zeros(1), 0)

    def reset(self, position_rad: Array, seed: int) -> Exchange:
        self.rng = np.random.default_rng(seed)
        self.t_s = 0.0
        self.cup = [float(position_rad[0]), 0.0]
        start = self.rng.uniform(-0.003, 0.003)
        stretch = self.game.ball.mass_kg * self.game.gravity_m_s2 / self.game.rope.stiffness_n_m
        self.ball = [self.cup[0] + start, -self.rope_m - stretch, 0.0, 0.0]
        self.caught = False
        command = JointCommand(np.array([self.cup[0]]), np.zeros(1), np.zeros(1))
        self.queue = [command] * (self.delay_n + 1)
        self.tracked: list[tuple[Array, Array]] = []
        return self._reported(command)

    def exchange(self, command: JointCommand) -> Exchange:
        self.queue = [*self.queue[1:], command]
        now = self.queue[0]
        begin, end = self.cup[0], float(now.position_rad[0])
        speed = float(now.velocity_rad_s[0])
        n = round(self.period_s / STEP_S)
        for k in range(1, n + 1):
            self._step(begin + (end - begin) * k / n, (end - begin) / self.period_s)
        self.cup[1] = speed
        self.t_s += self.period_s
        return self._reported(command)

    def halt(self) -> None:
        pass

    def close(self) -> None:
        pass

    def _step(self, cup_x: float, cup_v: float) -> None:
        game, h = self.game, STEP_S
        self.cup[0] = cup_x
        x, z, vx, vz = self.ball
        if self.caught:
            self.ball = [cup_x, game.ball.radius_m, cup_v, 0.0]
            return
        drag = self.drag_per_s + self.drag_per_m * math.hypot(vx, vz)
        ax, az = -drag * vx, -drag * vz - game.gravity_m_s2
        pull = rope_pull(self.law, (x - cup_x, 0.0, z), (vx - cup_v, 0.0, vz))
        if pull.tension_n > 0.0:
            ax += pull.force_n[0] / game.ball.mass_kg
            az += pull.force_n[2] / game.ball.mass_kg
        vx, vz = vx + ax * h, vz + az * h
        rim = game.cup.depth_m
        if z >= rim > z + vz * h:
            self.caught = abs(x + vx * h - cup_x) < game.cup.radius_m - 0.5 * game.ball.radius_m
        self.ball = [x + vx * h, z + vz * h, vx, vz]

    def _reported(self, sent: JointCommand) -> Exchange:
        def seen(point: Array) -> Array:
            return np.asarray(point + self.noise_m * self.rng.standard_normal(3))

        cup, ball = np.array([self.cup[0], 0.0, 0.0]), np.array([self.ball[0], 0.0, self.ball[1]])
        self.tracked.append((seen(MIDDLE_M + cup), seen(MIDDLE_M + ball)))
        told = self.tracked[max(len(self.tracked) - 1 - self.tracking_late_n, 0)]
        state = RobotState(
            np.array([self.cup[0]]), np.array([self.cup[1]]), np.zeros(1), np.zeros(6), *told, self.caught
        )
        scene = SceneState(state.position_rad, MIDDLE_M + cup, np.eye(3), MIDDLE_M + ball)
        return Exchange(sent, state, self.t_s, scene)
