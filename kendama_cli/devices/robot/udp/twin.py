"""The simulated robot behind UDP: a twin of the real one, with a body that differs a little from the model."""

from __future__ import annotations

import os
import socket
from collections.abc import Callable, Mapping
from typing import Any

from kendama_cli.devices.robot.rebuilt import rebuilt_robot
from kendama_cli.devices.robot.task import Task
from kendama_cli.devices.robot.udp.protocol import VERSION
from kendama_cli.devices.robot.udp.server import RobotServer
from kendama_cli.errors import HardwareError
from kendama_cli.settings.hardware import TwinHardware
from kendama_cli.settings.robot import RobotSettings

LOOPBACK = "127.0.0.1"


def serve_twin(
    robot: RobotSettings,
    task: Task,
    hardware: TwinHardware,
    secret: bytes,
    *,
    host: str = LOOPBACK,
    port: int = 0,
    on_ready: Callable[[Mapping[str, Any]], None],
    keep_going: Callable[[], bool] = lambda: True,
) -> None:
    """Serve a simulated robot on ``host:port`` (0: any free port) until interrupted or ``keep_going()`` is false.

    Who has ``secret`` may command it. ``on_ready`` is called once, when datagrams can come, with ``host, port,
    protocol, pid``. Raises HardwareError where the address cannot be used.
    """
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as line:
        try:
            line.bind((host, port))
        except (OSError, OverflowError) as error:
            raise HardwareError(f"the twin cannot listen on {host}:{port}: {error}; choose another port") from None
        server = RobotServer(
            lambda: rebuilt_robot(hardware, robot, task),
            line,
            secret,
            realtime=hardware.realtime,
            watchdog_s=hardware.watchdog_s,
            keep_going=keep_going,
        )
        bound, number = line.getsockname()
        on_ready({"host": bound, "port": number, "protocol": VERSION, "pid": os.getpid()})
        server.serve()
