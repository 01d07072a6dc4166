"""An arm in MuJoCo as a child process: checked, started and connected to, and run as that process."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from typing import Any

from kendama_cli.devices.robot.udp.remote import UdpRobot
from kendama_cli.devices.robot.udp.robot_process import robot_process, serve_input
from kendama_cli.devices.robot.udp.twin import serve_robot
from kendama_cli.devices.robot.udp.twin_client import settings_document
from kendama_cli.plugins.mujoco.robot import MujocoRobot
from kendama_cli.plugins.mujoco.settings import MujocoHardware
from kendama_cli.schema.settings import build_value
from kendama_cli.settings.game import GameSettings
from kendama_cli.settings.robot import RobotSettings

NAME = "the arm in MuJoCo"


@contextmanager
def open_mujoco(hardware: MujocoHardware, robot: RobotSettings, game: GameSettings) -> Iterator[UdpRobot]:
    """Start the arm in a process of its own, which ends with this context.

    Raises MissingPartError without MuJoCo, ConfigError or InputError where the model cannot carry the game (see
    ``build_arm``), HardwareError where the process does not start.
    """
    MujocoRobot(robot, game, hardware)  # what is wrong is told here, not by a process that ended
    document, module = settings_document(robot, game, hardware), "kendama_cli.plugins.mujoco.process"
    with robot_process(NAME, module, document, silence_s=hardware.silence_s) as client:
        yield client


def serve_document(
    document: Mapping[str, Any],
    secret: bytes,
    *,
    on_ready: Callable[[Mapping[str, Any]], None],
    keep_going: Callable[[], bool],
) -> None:
    """Serve the arm of ``document``; see Serve."""
    robot = build_value(RobotSettings, document["robot"], "robot")
    game = build_value(GameSettings, document["game"], "game")
    hardware = build_value(MujocoHardware, document["hardware"], "hardware")
    serve_robot(
        lambda: MujocoRobot(robot, game, hardware),
        secret,
        realtime=False,
        watchdog_s=hardware.silence_s,
        on_ready=on_ready,
        keep_going=keep_going,
    )


if __name__ == "__main__":
    sys.exit(serve_input(NAME, serve_document))
