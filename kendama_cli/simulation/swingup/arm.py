"""The engine ``dart``: the whole arm carries the cup along its line, the ball hangs from it and touches both."""

from __future__ import annotations

import math

import numpy as np

from kendama_cli.errors import ConfigError
from kendama_cli.learning.settings import LearnSettings
from kendama_cli.learning.state import SwingState
from kendama_cli.motion.even_spline import cubic, piece_at
from kendama_cli.physics.taut_rope import TautRope
from kendama_cli.robot_model.placement.placement import CupLine
from kendama_cli.settings.game import GameSettings
from kendama_cli.settings.robot import RobotSettings
from kendama_cli.simulation.dart.arm_errors import WorldErrors
from kendama_cli.simulation.dart.world import STEP_S, ArmWorld
from kendama_cli.system.compiled import Array, compiled


@compiled
def references(  # noqa: PLR0917 - plain numbers and arrays, as compiled code takes them
    pieces: Array, first_m: float, knot_m: float, cup: Array, acceleration_m_s2: float, period_s: float, out: Array
) -> None:
    """Move ``cup`` on, whose numbers are x and v, at a constant acceleration a; the joints at the end of every period.

        q' = q_x v,   q'' = q_x a + q_xx v^2

    ``pieces`` (4, k, n) are the coefficients of the cubics q(x), the highest power first, from ``first_m`` on, each
    ``knot_m`` long; beyond the ends the last ones go on. ``out`` (m, 3, n) holds q, q' and q'' at m instants.
    """
    for instant in range(out.shape[0]):
        cup[0] += cup[1] * period_s + 0.5 * acceleration_m_s2 * period_s * period_s
        cup[1] += acceleration_m_s2 * period_s
        x, v = cup
        k, u = piece_at(x, first_m, knot_m, pieces.shape[1])
        for i in range(out.shape[2]):
            a, b, c, d = pieces[0, k, i], pieces[1, k, i], pieces[2, k, i], pieces[3, k, i]
            out[instant, 0, i], slope, bend = cubic(a, b, c, d, u)
            out[instant, 1, i] = slope * v
            out[instant, 2, i] = slope * acceleration_m_s2 + bend * v * v


MARGIN_M = 0.01
"""The line goes on so far beyond the workspace: the error of an acceleration carries the reference a little over."""


class ArmSwing:
    """The world of the whole arm (ArmWorld) with the cup's acceleration along x as its only input.

    The acceleration is integrated to a reference along the line of the upright cup, which becomes the joints' motion;
    drive, controller, motors and friction of the arm follow it. The attributes are what the cup and the ball really do
    (see SwingEngine): the cup lags behind ``reference``, and the ball's pull moves it.

    Raises ConfigError where ``learn.step_s`` is no multiple of the world's step, StageError where the arm cannot carry
    the upright cup through the workspace.
    """

    def __init__(self, robot: RobotSettings, settings: LearnSettings, game: GameSettings) -> None:
        steps = round(settings.step_s / STEP_S)
        if steps < 1 or not math.isclose(steps * STEP_S, settings.step_s, rel_tol=1e-9):
            raise ConfigError(
                "learn.step_s",
                f"'learn.step_s' is {settings.step_s}; allowed with simulation/engine=dart: multiples of {STEP_S}",
            )
        self._world = ArmWorld(robot, game, links=True)
        self._line = CupLine(self._world.arm, _reach_m(settings))
        curve = self._line.curve
        self._pieces, self._first_m, self._knot_m = curve.coefficients, curve.start, curve.step
        self._home_x_m = float(self._line.home_m[0])
        self._game = game
        self._stretched = TautRope.hanging(game)
        self._cup = np.zeros(2)
        self._motion = np.zeros((steps, 3, len(self._world.arm.joint_names)))
        self._instants = [tuple(instant) for instant in self._motion]
        self.start(SwingState(0.0, 0.0, 0.0, 0.0))

    def start(self, state: SwingState) -> None:
        """Put arm and ball into ``state`` with the rope stretched as by the hanging ball."""
        point = self._line.at(state.x_m, state.velocity_m_s, 0.0)
        self._cup[:] = state.x_m, state.velocity_m_s
        world = self._world
        world.reset(point.position_rad, point.velocity_rad_s)
        ball = self._stretched.ball(state.angle_rad, state.rate_rad_s)
        x, y, z = world.ball.tie_m.tolist()
        position = [x + ball.across_m, y, z + ball.above_m]
        world.ball.put(position, [state.velocity_m_s + ball.across_m_s, 0.0, ball.above_m_s])
        self._read()

    def step(self, acceleration_m_s2: float) -> None:
        """Advance by ``learn.step_s``; raises SimulationError where arm or ball leave their domain."""
        motion = (self._pieces, self._first_m, self._knot_m, self._cup, float(acceleration_m_s2), STEP_S, self._motion)
        references(*motion)
        step = self._world.step
        for position_rad, velocity_rad_s, acceleration_rad_s2 in self._instants:
            step(position_rad, velocity_rad_s, acceleration_rad_s2)
        self._read()

    @property
    def reference(self) -> tuple[float, float]:
        """Return the commanded position and velocity of the cup, x [m] and v [m/s]."""
        x_m, velocity_m_s = self._cup.tolist()
        return x_m, velocity_m_s

    @property
    def tension_n(self) -> float:
        """The rope's tension in the step that led here [N]."""
        return self._world.ball.tension_n

    @property
    def in_cup(self) -> bool:
        """Return True if the ball lies in the cup."""
        return self._world.ball.is_in_cup()

    def take_on(self, rope_scale: float, drag_scale: float) -> None:
        """Take on a rope so many times as long and an air drag so many times as large, from the next ``start`` on."""
        self._world.perturb(WorldErrors(rope_scale=rope_scale, drag_scale=drag_scale))
        self._stretched = TautRope.hanging(self._game, rope_scale)

    def check_finite(self, t_s: float) -> None:
        """Do nothing: ``step`` has raised SimulationError if arm or ball have left their domain."""

    def _read(self) -> None:
        ball = self._world.ball
        x_m, _, z_m = ball.tie_m.tolist()
        velocity_m_s, _, rising_m_s = ball.tie_m_s.tolist()
        ball_x_m, _, ball_z_m = ball.position_m.tolist()
        ball_m_s, _, ball_rising_m_s = ball.velocity_m_s.tolist()
        self.x_m, self.velocity_m_s = x_m - self._home_x_m, velocity_m_s
        self.across_m, self.above_m = ball_x_m - x_m, ball_z_m - z_m
        self.across_m_s, self.above_m_s = ball_m_s - velocity_m_s, ball_rising_m_s - rising_m_s


def _reach_m(settings: LearnSettings) -> float:
    """Return the reach of the reference: with a limiter to the edge, without one as far as it takes to stop there."""
    workspace = settings.workspace
    if workspace.kind == "limit":
        return workspace.half_width_m + MARGIN_M
    weaker = min(-settings.actions_m_s2[0], settings.actions_m_s2[-1], settings.goal.catch_acceleration_m_s2)
    return workspace.half_width_m + workspace.max_speed_m_s**2 / (2.0 * weaker) + MARGIN_M
