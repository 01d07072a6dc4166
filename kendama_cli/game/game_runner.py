"""All that a swing-up or a game on the robot needs, put together once."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from kendama_cli.devices.robot.interface import Robot
from kendama_cli.game.catch_game import CatchGeometry, Game, finish_game
from kendama_cli.game.cup_cart import CartStep, CupCart, Line
from kendama_cli.game.cup_tilt import TiltingArm
from kendama_cli.game.flight_observer import FlightObserver
from kendama_cli.game.settings import CatchSettings, TransferSettings
from kendama_cli.game.swing_state import SwingStateEstimator
from kendama_cli.game.swing_up import Actor, SwingUpRollout, swing_up
from kendama_cli.learning.limiter import BrakingLimiter
from kendama_cli.learning.reward import Flight, Goal
from kendama_cli.learning.settings import LearnSettings
from kendama_cli.learning.task_settings import LimitedWorkspace
from kendama_cli.robot_model.model import RobotModel
from kendama_cli.schema.arrays import Array
from kendama_cli.settings.game import GameSettings

RESERVE = 0.9
"""Part of the largest acceleration that braking counts on where the settings do not say."""


def make_catch_geometry(
    middle_m: Array, direction: Array, game: GameSettings, catch: CatchSettings, *, rope_scale: float, period_s: float
) -> CatchGeometry:
    """The court about ``middle_m`` (3,), the tie point where the cup's x is 0, along ``direction`` (3,), a unit vector.

    ``rope_scale`` is the real rope's length over the model's.
    """
    rim_m = float(middle_m[2]) + game.cup.depth_m
    return CatchGeometry(
        middle_m=np.asarray(middle_m),
        direction=np.asarray(direction),
        catch_height_m=rim_m - catch.below_rim_m,
        rim_height_m=rim_m + game.ball.radius_m,
        flight=Flight(rope_scale * game.rope.length_m, game.cup.depth_m, game.gravity_m_s2),
        limiter=BrakingLimiter(
            half_width_m=catch.half_width_m,
            max_speed_m_s=catch.max_speed_m_s,
            braking_m_s2=RESERVE * catch.acceleration_m_s2,
            largest_m_s2=catch.acceleration_m_s2,
            period_s=period_s,
        ),
    )


class GameRunner:
    """A robot with the cup on a line, the swing-up's goal, and what watches the flight.

    Without its ``arm`` the cup stays upright on the line.
    """

    def __init__(
        self,
        robot: Robot,
        line: Line,
        *,
        court: CatchGeometry,
        flight_watch: FlightObserver,
        game: GameSettings,
        learn: LearnSettings,
        settings: TransferSettings,
        arm: RobotModel | None = None,
    ) -> None:
        self.robot = robot
        self._court, self._flight_watch = court, flight_watch
        self._settings = settings
        self._rollout_s = learn.rollout_s
        scale = court.flight.rope_m / game.rope.length_m
        watch = SwingStateEstimator(
            robot.period_s,
            settings.observation.samples_n,
            court.middle_m,
            court.direction,
            rope_m=court.flight.rope_m,
            gravity_m_s2=game.gravity_m_s2,
        )
        leaning = None if arm is None else TiltingArm(arm, court.middle_m, court.direction, robot.period_s)
        self._cart = CupCart(robot, line, watch, game, scale, leaning=leaning)
        room, catch, strongest = learn.workspace, settings.catch, learn.largest_action_m_s2
        braking = room.braking_m_s2 if isinstance(room, LimitedWorkspace) else RESERVE * strongest
        self._swing_limiter = BrakingLimiter(
            # by similarity a longer rope needs a wider and faster room; there is no more than the catch may use
            half_width_m=min(scale * room.half_width_m, max(room.half_width_m, catch.half_width_m)),
            max_speed_m_s=min(self._cart.tempo * room.max_speed_m_s, max(room.max_speed_m_s, catch.max_speed_m_s)),
            braking_m_s2=braking,
            largest_m_s2=strongest,
            period_s=robot.period_s,
        )
        self._goal = Goal(learn.goal, court.flight)

    def swing_up(self, actor: Actor, *, seed: int) -> SwingUpRollout:
        """One swing-up from rest; raises HardwareError of the line."""
        return self._swing_up(actor, seed)

    def play(self, actor: Actor, *, seed: int, pictured: bool = False) -> Game:
        """One full game from rest, whole images of it kept where ``pictured``; raises HardwareError of the line."""
        watch = self._flight_watch
        watch.begin(seed, pictured=pictured)
        return finish_game(
            self._swing_up(actor, seed, watched=watch.swinging),
            self._cart,
            self._court,
            watch,
            catch=self._settings.catch,
            believed_sigma_m=self._settings.observation.believed_sigma_m,
        )

    def _swing_up(
        self, actor: Actor, seed: int, watched: Callable[[CartStep], None] = lambda step: None
    ) -> SwingUpRollout:
        return swing_up(
            self._cart,
            actor,
            self._goal,
            self._swing_limiter,
            rollout_s=self._rollout_s,
            seed=seed,
            watched=watched,
        )
