"""A twin as a child process: started and connected to, and run as that process (see robot_process.py)."""

from __future__ import annotations

import dataclasses
import json
import sys
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from typing import Any

from kendama_cli.devices.robot.udp.remote import UdpRobot
from kendama_cli.devices.robot.udp.robot_process import robot_process, serve_input
from kendama_cli.devices.robot.udp.twin import serve_twin
from kendama_cli.schema.settings import build_value
from kendama_cli.settings.game import GameSettings
from kendama_cli.settings.hardware import TwinHardware
from kendama_cli.settings.robot import RobotSettings

TWIN = "the twin"


@contextmanager
def open_twin(hardware: TwinHardware, robot: RobotSettings, game: GameSettings) -> Iterator[UdpRobot]:
    """Start a twin in a process of its own, which ends with this context; raises HardwareError if it does not start."""
    document, module = settings_document(robot, game, hardware), "kendama_cli.devices.robot.udp.twin_client"
    with robot_process(TWIN, module, document, silence_s=hardware.silence_s) as client:
        yield client


def settings_document(robot: RobotSettings, game: GameSettings, hardware: Any) -> str:
    """Return the one JSON line with the simulation of such a process; ``hardware`` are its settings, a dataclass."""
    parts: dict[str, Any] = {"robot": robot, "game": game, "hardware": hardware}
    return json.dumps({name: dataclasses.asdict(part) for name, part in parts.items()})


def serve_document(
    document: Mapping[str, Any],
    secret: bytes,
    *,
    on_ready: Callable[[Mapping[str, Any]], None],
    keep_going: Callable[[], bool],
) -> None:
    """Serve the twin of ``document``; see Serve."""
    robot = build_value(RobotSettings, document["robot"], "robot")
    game = build_value(GameSettings, document["game"], "game")
    hardware = build_value(TwinHardware, document["hardware"], "hardware")
    serve_twin(robot, game, hardware, secret, on_ready=on_ready, keep_going=keep_going)


if __name__ == "__main__":
    sys.exit(serve_input(TWIN, serve_document))
