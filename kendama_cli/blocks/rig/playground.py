"""All that a swing-up or a game on the robot needs, put together once."""

from __future__ import annotations

import numpy as np

from kendama_cli.artifacts.checks import Array
from kendama_cli.blocks.rig.catch_game import Court, Game, finish_game
from kendama_cli.blocks.rig.cup_cart import CupCart, Line
from kendama_cli.blocks.rig.swing_up import Actor, Swing, swing_up
from kendama_cli.blocks.rig.swing_watch import SwingWatch
from kendama_cli.blocks.robot.remote import UdpRobot
from kendama_cli.learning.limiter import BrakingLimiter
from kendama_cli.learning.reward import Flight, Goal
from kendama_cli.settings.game import GameSettings
from kendama_cli.settings.learn import LearnSettings, LimitedWorkspace
from kendama_cli.settings.transfer import TransferSettings
from kendama_cli.vision.catch_pose import CatchPoseEstimator

RESERVE = 0.9
"""Part of the largest acceleration that braking counts on where the settings do not say."""


class Playground:
    """A robot with the cup on a line, the swing-up's goal, and what watches the flight.

    ``rope_scale`` is the real rope's length over the model's. ``middle_m`` and ``direction`` (3,) place the line in
    the world: the rope's tie point where the cup's x is 0, and the unit vector of x.
    """

    def __init__(
        self,
        robot: UdpRobot,
        line: Line,
        *,
        middle_m: Array,
        direction: Array,
        game: GameSettings,
        learn: LearnSettings,
        settings: TransferSettings,
        rope_scale: float = 1.0,
    ) -> None:
        self.robot = robot
        self._game = game
        self._settings = settings
        self._rollout_s = learn.rollout_s
        watch = SwingWatch(robot.period_s, settings.observation.samples_n, middle_m, direction)
        self._cart = CupCart(robot, line, watch, game, rope_scale)
        room, strongest = learn.workspace, learn.largest_action_m_s2
        braking = room.braking_m_s2 if isinstance(room, LimitedWorkspace) else RESERVE * strongest
        self._swing_limiter = BrakingLimiter(
            half_width_m=room.half_width_m,
            max_speed_m_s=room.max_speed_m_s,
            braking_m_s2=braking,
            largest_m_s2=strongest,
            period_s=robot.period_s,
        )
        catch = settings.catch
        limiter = BrakingLimiter(
            half_width_m=catch.half_width_m,
            max_speed_m_s=catch.max_speed_m_s,
            braking_m_s2=RESERVE * catch.acceleration_m_s2,
            largest_m_s2=catch.acceleration_m_s2,
            period_s=robot.period_s,
        )
        flight = Flight(rope_scale * game.rope.length_m, game.cup.depth_m, game.gravity_m_s2)
        self._goal = Goal(learn.goal, flight)
        rim_m = float(middle_m[2]) + game.cup.depth_m
        self._court = Court(
            middle_m=np.asarray(middle_m),
            direction=np.asarray(direction),
            catch_height_m=rim_m - settings.catch.below_rim_m,
            rim_height_m=rim_m + game.ball.radius_m,
            flight=flight,
            limiter=limiter,
        )

    def swing_up(self, actor: Actor, *, seed: int) -> Swing:
        """One swing-up from rest; raises HardwareError of the line."""
        return swing_up(self._cart, actor, self._goal, self._swing_limiter, rollout_s=self._rollout_s, seed=seed)

    def play(self, actor: Actor, *, seed: int) -> Game:
        """One full game from rest; raises HardwareError of the line."""
        drag_per_s = self._game.ball.drag_n_s_m / self._game.ball.mass_kg
        return finish_game(
            self.swing_up(actor, seed=seed),
            self._cart,
            self._court,
            CatchPoseEstimator(self._game.gravity_m_s2, drag_per_s, self._court.rim_height_m),
            observation=self._settings.observation,
            catch=self._settings.catch,
        )
