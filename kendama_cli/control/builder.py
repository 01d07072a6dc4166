"""Wires a game on a robot: from the settings and an opened robot to what swings up and plays."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial

import numpy as np

from kendama_cli.control.catch_geometry import make_catch_geometry
from kendama_cli.control.cup_tilt import TiltingArm
from kendama_cli.control.game_runner import GameRunner
from kendama_cli.control.open_observer import CameraSetup, check_cameras, open_observer
from kendama_cli.control.rope_fit import measured_rope_m
from kendama_cli.control.scene_history import SceneHistory, SceneRecordingRobot, joint_places
from kendama_cli.control.settings import TransferSettings
from kendama_cli.devices.robot.interface import Robot
from kendama_cli.learning.settings import LearnSettings
from kendama_cli.robot_model.model import RobotModel
from kendama_cli.robot_model.placement.placement import cup_line
from kendama_cli.settings.game import GameSettings
from kendama_cli.settings.placement import Placement, placed
from kendama_cli.settings.robot import RobotSettings

LINE_DIRECTION = np.array([1.0, 0.0, 0.0])
"""The cup swings along the world's x."""


@dataclass(frozen=True)
class GameSetup:
    """What the configuration says of a game on a robot."""

    robot: RobotSettings
    game: GameSettings
    learn: LearnSettings
    transfer: TransferSettings
    cameras: CameraSetup

    def placed_at(self, placement: Placement) -> GameSetup:
        """The same with the arm at ``placement``."""
        return dataclasses.replace(self, robot=placed(self.robot, placement))


class GameBuilder:
    """Solves the cup's line for the arm, then wires the game on a robot that has been opened.

    ``arm`` is the model of the robot. Raises StageError where the arm cannot follow the line.
    """

    def __init__(self, setup: GameSetup) -> None:
        self._setup = setup
        half_width_m = max(setup.learn.workspace.half_width_m, setup.transfer.catch.half_width_m)
        self._line = cup_line(setup.robot, setup.game, half_width_m)
        self.arm = RobotModel(setup.robot, setup.game.cup, setup.game.gravity_m_s2)

    @contextmanager
    def open(self, robot: Robot, *, seed: int) -> Iterator[GameRunner]:
        """The game on ``robot``, after its rope was measured hanging (noise drawn from ``seed``); closes its cameras.

        Raises ConfigError where the configured cameras cannot observe this robot, MissingPartError where one is not
        there, HardwareError of the line.
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
            setup.cameras, transfer.observation, game, cup_place=arm.tool_place_m, history=history, geometry=geometry
        ) as observer:
            yield GameRunner(
                recording,
                line,
                geometry=geometry,
                observer=observer,
                game=game,
                learn=setup.learn,
                settings=transfer,
                tilting=TiltingArm(arm, geometry.middle_m, geometry.direction, robot.period_s),
                history=history,
            )
