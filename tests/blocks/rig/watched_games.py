"""Games of the quick cart robot through rendered images."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, cast

import numpy as np
import yaml

from kendama_cli.artifacts.checks import Array
from kendama_cli.blocks.rig.eyes import Eyes
from kendama_cli.blocks.rig.open_watch import Sight, open_watch
from kendama_cli.blocks.rig.playground import Playground, make_court
from kendama_cli.blocks.rig.scene_history import SceneHistory, VeiledRobot
from kendama_cli.blocks.robot.interface import DistantRobot
from kendama_cli.settings.camera import CameraSettings, LightingSettings
from kendama_cli.settings.game import GameSettings
from kendama_cli.settings.predict import PredictSettings
from kendama_cli.settings.schema import build_value
from kendama_cli.settings.transfer import TransferSettings
from tests.blocks.rig.cart_robot import DIRECTION, MIDDLE_M, CartRobot, Straight
from tests.learning.settings_files import learn_settings

CONF = Path(__file__).resolve().parents[3] / "conf"


def configured(schema: Any, group: str, name: str) -> Any:
    return build_value(schema, yaml.safe_load((CONF / group / f"{name}.yaml").read_text()), group)


GAME: GameSettings = configured(GameSettings, "game", "kendama")
LEARN = learn_settings()
TRANSFER: TransferSettings = configured(TransferSettings, "transfer", "default")
SIGHT = Sight(
    configured(CameraSettings, "camera", "virtual"),
    configured(LightingSettings, "lighting", "bright"),
    configured(PredictSettings, "predict", "flights"),
)


def on_the_line(position_rad: Array) -> Array:
    """The tie point of the robot whose only joint is x."""
    return np.asarray(MIDDLE_M + position_rad[0] * DIRECTION)


@contextmanager
def watched_ground(
    wrap: Callable[[DistantRobot], DistantRobot] = lambda robot: robot, sight: Sight = SIGHT, **made: Any
) -> Iterator[tuple[Playground, Eyes]]:
    """A playground whose flights are seen by cameras; ``wrap`` comes between the robot and the game."""
    history = SceneHistory(lambda _: np.empty((0, 3)), GAME.rope.length_m, MIDDLE_M)
    robot = wrap(VeiledRobot(cast(DistantRobot, CartRobot(GAME, **made)), history))
    robot.reset(np.zeros(1), 0)
    court = make_court(MIDDLE_M, DIRECTION, GAME, TRANSFER.catch, rope_scale=1.0, period_s=robot.period_s)
    with open_watch(
        sight, TRANSFER.observation, GAME, cup_place=on_the_line, history=history, court=court
    ) as flight_watch:
        eyes = cast(Eyes, flight_watch)
        ground = Playground(
            robot, Straight(), court=court, flight_watch=eyes, game=GAME, learn=LEARN, settings=TRANSFER
        )
        yield ground, eyes
