"""Swing-ups and whole games on a robot, wired from the settings: estimator, controllers and observer."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial

import numpy as np

from kendama_cli.control.catch_controller import CatchGeometry, goal_here, make_catch_geometry
from kendama_cli.control.catch_game import Game, finish_game
from kendama_cli.control.cup_cart import CartStep, CupCart, TiltingArm
from kendama_cli.control.flight_observer import FlightObserver
from kendama_cli.control.imitation import measured_rope_m
from kendama_cli.control.open_observer import CameraSetup, check_cameras, open_observer
from kendama_cli.control.scene_history import SceneHistory, SceneRecordingRobot, joint_places
from kendama_cli.control.settings import TransferSettings
from kendama_cli.control.swing_state import SwingStateEstimator
from kendama_cli.control.swing_up import SwingUpActor, SwingUpRollout, swing_up
from kendama_cli.devices.camera.calibration import camera_models
from kendama_cli.devices.robot.interface import Robot
from kendama_cli.learning.reward import Goal
from kendama_cli.learning.settings import LearnSettings
from kendama_cli.learning.task_settings import LimitedWorkspace
from kendama_cli.motion.braking import BRAKING_SHARE, BrakingLimiter
from kendama_cli.robot_model.model import RobotModel
from kendama_cli.robot_model.placement.placement import CupLine
from kendama_cli.settings.game import GameSettings
from kendama_cli.settings.placement import Placement, placed
from kendama_cli.settings.robot import RobotSettings

LINE_DIRECTION = np.array([1.0, 0.0, 0.0])
"""The cup swings along the world's x."""


class GameRunner:
    """Robot with the cup on a line, the swing-up's goal, and the observer of the flight.

    Without a ``tilting`` arm the cup stays upright on the line.
    """

    def __init__(
        self,
        robot: Robot,
        line: CupLine,
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
        """Scene of the present rollout as the robot reported it."""
        self._geometry, self.observer = geometry, observer
        self._settings, self.game = settings, game
        self._rollout_s = learn.rollout_s
        scale = geometry.flight.rope.length_m / game.rope.length_m
        estimator = SwingStateEstimator(
            robot.period_s,
            settings.observation.samples_n,
            geometry.center_m,
            geometry.direction,
            rope=geometry.flight.rope,
            gravity_m_s2=game.gravity_m_s2,
        )
        self._cart = CupCart(robot, line, estimator, game, scale, tilting=tilting)
        workspace, catch, strongest = learn.workspace, settings.catch, learn.max_action_m_s2
        braking = workspace.braking_m_s2 if isinstance(workspace, LimitedWorkspace) else BRAKING_SHARE * strongest
        widest_m = max(workspace.half_width_m, catch.half_width_m)
        fastest_m_s = max(workspace.max_speed_m_s, catch.max_speed_m_s)
        self._swing_limiter = BrakingLimiter(
            # by similarity a longer rope needs a wider and faster workspace; there is no more than the catch may use
            half_width_m=min(scale * workspace.half_width_m, widest_m),
            max_speed_m_s=min(self._cart.time_scale * workspace.max_speed_m_s, fastest_m_s),
            braking_m_s2=braking,
            max_m_s2=strongest,
            period_s=robot.period_s,
        )
        self._goal = Goal(goal_here(learn.goal, settings.catch), geometry.flight)

    def swing_up(
        self, actor: SwingUpActor, *, seed: int, observe: Callable[[CartStep], None] = lambda step: None
    ) -> SwingUpRollout:
        """Swing up once from rest, with ``observe`` after every control period; raises HardwareError of the line."""
        return swing_up(
            self._cart,
            actor,
            self._goal,
            self._swing_limiter,
            rollout_s=self._rollout_s,
            seed=seed,
            observe=observe,
        )

    def play(self, actor: SwingUpActor, *, seed: int, pictured: bool = False) -> Game:
        """Play one full game from rest, with whole images of it if ``pictured``; raises HardwareError of the line."""
        observer = self.observer
        observer.begin(seed, pictured=pictured)
        return finish_game(
            self.swing_up(actor, seed=seed, observe=observer.swinging),
            self._cart,
            self._geometry,
            observer,
            game=self.game,
            catch=self._settings.catch,
            max_sigma_m=self._settings.observation.max_sigma_m,
        )


@dataclass(frozen=True)
class GameSetup:
    """Settings of a game on a robot."""

    robot: RobotSettings
    game: GameSettings
    learn: LearnSettings
    transfer: TransferSettings
    cameras: CameraSetup

    def placed_at(self, placement: Placement) -> GameSetup:
        """Return the same with the arm at ``placement``."""
        return dataclasses.replace(self, robot=placed(self.robot, placement))


class GameBuilder:
    """Builder of a game: solves the cup's line for the arm, then wires the game on a robot that has been opened.

    ``arm`` is the model of the robot. Raises StageError if the arm cannot follow the line on which it ``swings`` up; an
    imitation alone needs but its middle.
    """

    def __init__(self, setup: GameSetup, *, swings: bool = True) -> None:
        self._setup = setup
        half_width_m = max(setup.learn.workspace.half_width_m, setup.transfer.catch.half_width_m)
        self.arm = RobotModel(setup.robot, setup.game.cup, setup.game.gravity_m_s2)
        if setup.transfer.observation.source == "cameras":
            for camera in camera_models(setup.cameras.camera, carried=True):
                if camera.link is not None:  # a wrong name is told before anything moves
                    self.arm.link_pose(camera.link, self.arm.home_rad)
        self._line = CupLine(self.arm, half_width_m)
        if swings:
            _ = self._line.curve

    @contextmanager
    def open(self, robot: Robot, *, seed: int) -> Iterator[GameRunner]:
        """Open the game on ``robot``, its rope measured hanging (noise sampled from ``seed``); close its cameras.

        Raises ConfigError if the configured cameras cannot observe this robot, MissingPartError if one is missing,
        HardwareError of the line.
        """
        setup, arm, line = self._setup, self.arm, self._line
        game, transfer = setup.game, setup.transfer
        check_cameras(setup.cameras, transfer.observation, realtime=robot.realtime)
        origin_m = line.home_m if transfer.observation.camera_origin == "line" else np.zeros(3)
        history = SceneHistory(partial(joint_places, arm), game.rope.length_m, origin_m, game.cup.tie_m)
        recording = SceneRecordingRobot(robot, history)
        history.rope_m = measured_rope_m(recording, line.home_rad, game, seed)
        geometry = make_catch_geometry(
            line.home_m,
            LINE_DIRECTION,
            game,
            transfer.catch,
            rope_scale=history.rope_m / game.rope.length_m,
            period_s=robot.period_s,
        )
        with open_observer(
            setup.cameras,
            transfer.observation,
            game,
            cup_place=arm.tool_position_m,
            link_pose=arm.link_pose,
            history=history,
            geometry=geometry,
        ) as observer:
            yield GameRunner(
                recording,
                line,
                geometry=geometry,
                observer=observer,
                game=game,
                learn=setup.learn,
                settings=transfer,
                tilting=TiltingArm(arm, geometry.center_m, geometry.direction, robot.period_s),
                history=history,
            )
