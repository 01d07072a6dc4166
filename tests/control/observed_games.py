"""Games of the quick cart robot through rendered images."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any, cast

import numpy as np

from kendama_cli.control.camera_observer import CameraObserver
from kendama_cli.control.catch_controller import make_catch_geometry
from kendama_cli.control.game_runner import GameRunner
from kendama_cli.control.open_observer import CameraSetup, open_observer
from kendama_cli.control.scene_history import SceneHistory, SceneRecordingRobot
from kendama_cli.control.settings import TransferSettings
from kendama_cli.devices.robot.interface import Robot
from kendama_cli.robot_model.model import ToolPose
from kendama_cli.schema.arrays import Array
from kendama_cli.settings.camera import CameraSettings, LightingSettings
from kendama_cli.settings.game import GameSettings
from kendama_cli.vision.settings import PredictSettings
from tests.control.cart_robot import DIRECTION, MIDDLE_M, CartRobot, Straight
from tests.learning.settings_files import learn_settings
from tests.shipped_conf import configured

GAME: GameSettings = configured(GameSettings, "game", "kendama")
LEARN = learn_settings()
TRANSFER: TransferSettings = configured(TransferSettings, "transfer", "default")
CAMERAS = CameraSetup(
    configured(CameraSettings, "camera", "virtual"),
    configured(LightingSettings, "lighting", "bright"),
    configured(PredictSettings, "predict", "flights"),
)


def on_the_line(position_rad: Array) -> Array:
    """The tie point of the robot whose only joint is x."""
    return np.asarray(MIDDLE_M + position_rad[0] * DIRECTION)


def cart_pose(_: str, position_rad: Array) -> ToolPose:
    """The only link of that robot stands at the tie point."""
    return ToolPose(on_the_line(position_rad), np.eye(3))


@contextmanager
def observed_runner(
    wrap: Callable[[Robot], Robot] = lambda robot: robot,
    cameras: CameraSetup = CAMERAS,
    link_pose: Callable[[str, Array], ToolPose] = cart_pose,
    **made: Any,
) -> Iterator[tuple[GameRunner, CameraObserver]]:
    """Games whose flights are observed by cameras; ``wrap`` comes between the robot and the game."""
    history = SceneHistory(lambda _: np.empty((0, 3)), GAME.rope.length_m, MIDDLE_M)
    robot = wrap(SceneRecordingRobot(cast(Robot, CartRobot(GAME, **made)), history))
    robot.reset(np.zeros(1), 0)
    geometry = make_catch_geometry(MIDDLE_M, DIRECTION, GAME, TRANSFER.catch, rope_scale=1.0, period_s=robot.period_s)
    with open_observer(
        cameras,
        TRANSFER.observation,
        GAME,
        cup_place=on_the_line,
        link_pose=link_pose,
        history=history,
        geometry=geometry,
    ) as observer:
        camera_observer = cast(CameraObserver, observer)
        runner = GameRunner(
            robot, Straight(), geometry=geometry, observer=observer, game=GAME, learn=LEARN, settings=TRANSFER
        )
        yield runner, camera_observer
