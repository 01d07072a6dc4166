"""The shipped FR3 and its hardware, on loopback."""

from __future__ import annotations

import dataclasses
from pathlib import Path

from kendama_cli.plugins.franka.settings import FrankaHardware
from kendama_cli.schema.settings import build_value
from kendama_cli.settings.game import GameSettings
from kendama_cli.settings.hardware import HardwareSettings
from kendama_cli.settings.robot import RobotSettings
from tests.shipped_conf import CONF, plain

GAME: GameSettings = build_value(GameSettings, plain("game", "kendama"), "game")
FR3: RobotSettings = build_value(
    RobotSettings, {**plain("robot", "fr3"), "path": str(CONF.parent / "data" / "robots" / "fr3.urdf")}, "robot"
)
FRANKA: FrankaHardware = dataclasses.replace(
    build_value(HardwareSettings, plain("hardware", "franka"), "hardware"),
    host="127.0.0.1",
    realtime="ignore",
    silence_s=5.0,
    wait_s=30.0,
)
HERE = Path(__file__).resolve().parent
