"""Swing-ups and whole games on a robot: the estimator, the controllers and the observer of one body."""

from __future__ import annotations

from collections.abc import Callable

from kendama_cli.control.catch_game import Game, finish_game
from kendama_cli.control.catch_geometry import CatchGeometry, goal_here
from kendama_cli.control.cup_cart import CartStep, CupCart, Line
from kendama_cli.control.cup_tilt import TiltingArm
from kendama_cli.control.flight_observer import FlightObserver
from kendama_cli.control.scene_history import SceneHistory
from kendama_cli.control.settings import TransferSettings
from kendama_cli.control.swing_state import SwingStateEstimator
from kendama_cli.control.swing_up import Actor, SwingUpRollout, swing_up
from kendama_cli.devices.robot.interface import Robot
from kendama_cli.learning.reward import Goal
from kendama_cli.learning.settings import LearnSettings
from kendama_cli.learning.task_settings import LimitedWorkspace
from kendama_cli.motion.braking import BRAKING_SHARE, BrakingLimiter
from kendama_cli.settings.game import GameSettings


class GameRunner:
    """A robot with the cup on a line, the swing-up's goal, and what observes the flight.

    Without a ``tilting`` arm the cup stays upright on the line.
    """

    def __init__(
        self,
        robot: Robot,
        line: Line,
        *,
        geometry: CatchGeometry,
        observer: FlightObserver,
        game: GameSettings,
        learn: LearnSettings,
        settings: TransferSettings,
        tilting: TiltingArm | None = None,
        history: SceneHistory | None = None,
    ) -> None:
        self.robot = robot
        self.history = history
        """What the robot reported of the present rollout's scene."""
        self._geometry, self.observer = geometry, observer
        self._settings, self.game = settings, game
        self._rollout_s = learn.rollout_s
        scale = geometry.flight.rope.length_m / game.rope.length_m
        estimator = SwingStateEstimator(
            robot.period_s,
            settings.observation.samples_n,
            geometry.middle_m,
            geometry.direction,
            rope=geometry.flight.rope,
            gravity_m_s2=game.gravity_m_s2,
        )
        self._cart = CupCart(robot, line, estimator, game, scale, tilting=tilting)
        workspace, catch, strongest = learn.workspace, settings.catch, learn.largest_action_m_s2
        braking = workspace.braking_m_s2 if isinstance(workspace, LimitedWorkspace) else BRAKING_SHARE * strongest
        widest_m = max(workspace.half_width_m, catch.half_width_m)
        fastest_m_s = max(workspace.max_speed_m_s, catch.max_speed_m_s)
        self._swing_limiter = BrakingLimiter(
            # by similarity a longer rope needs a wider and faster workspace; there is no more than the catch may use
            half_width_m=min(scale * workspace.half_width_m, widest_m),
            max_speed_m_s=min(self._cart.tempo * workspace.max_speed_m_s, fastest_m_s),
            braking_m_s2=braking,
            largest_m_s2=strongest,
            period_s=robot.period_s,
        )
        self._goal = Goal(goal_here(learn.goal, settings.catch), geometry.flight)

    def swing_up(self, actor: Actor, *, seed: int) -> SwingUpRollout:
        """One swing-up from rest; raises HardwareError of the line."""
        return self._swing_up(actor, seed)

    def play(self, actor: Actor, *, seed: int, pictured: bool = False) -> Game:
        """One full game from rest, whole images of it kept where ``pictured``; raises HardwareError of the line."""
        observer = self.observer
        observer.begin(seed, pictured=pictured)
        return finish_game(
            self._swing_up(actor, seed, observe=observer.swinging),
            self._cart,
            self._geometry,
            observer,
            game=self.game,
            catch=self._settings.catch,
            max_sigma_m=self._settings.observation.max_sigma_m,
        )

    def _swing_up(
        self, actor: Actor, seed: int, observe: Callable[[CartStep], None] = lambda step: None
    ) -> SwingUpRollout:
        return swing_up(
            self._cart,
            actor,
            self._goal,
            self._swing_limiter,
            rollout_s=self._rollout_s,
            seed=seed,
            observe=observe,
        )
