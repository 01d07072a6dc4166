"""The simulated robot behind UDP: a twin of the real one, with a body that differs a little from the model."""

from __future__ import annotations

import os
import socket
from collections.abc import Callable, Mapping
from typing import Any

from kendama_cli.devices.robot.interface import Exchange, JointCommand
from kendama_cli.devices.robot.protocol import VERSION
from kendama_cli.devices.robot.server import RobotServer
from kendama_cli.devices.robot.simulated import SimulatedRobot
from kendama_cli.errors import HardwareError
from kendama_cli.schema.arrays import Array
from kendama_cli.settings.game import GameSettings
from kendama_cli.settings.hardware import TwinHardware
from kendama_cli.settings.robot import RobotSettings

LOOPBACK = "127.0.0.1"


class RebuiltRobot:
    """A simulated robot that is built anew at every reset.

    DART's constraint solver starts from what it found before, so that a world which is only put back to its start
    remembers earlier rollouts in the last bits; a rollout must not depend on which ones came before it.
    """

    def __init__(self, build: Callable[[], SimulatedRobot]) -> None:
        self._build = build
        self._robot = build()
        self.joint_names = self._robot.joint_names
        self.limits = self._robot.limits
        self.period_s = self._robot.period_s
        self.realtime = False
        self.missed = 0
        self._halted = False

    def exchange(self, command: JointCommand) -> Exchange:
        """One control period; raises HardwareError after ``halt``, SimulationError for what is not finite."""
        return self._robot.exchange(command)

    def reset(self, position_rad: Array, seed: int) -> Exchange:
        """At rest in ``position_rad`` (n,); raises HardwareError after ``halt``."""
        if not self._halted:
            self._robot.close()
            self._robot = self._build()
        return self._robot.reset(position_rad, seed)

    def halt(self) -> None:
        """Stop and stay stopped."""
        self._halted = True
        self._robot.halt()

    def close(self) -> None:
        """Halt; there is no device to let go of."""
        self.halt()


def serve_twin(
    robot: RobotSettings,
    game: GameSettings,
    hardware: TwinHardware,
    *,
    host: str = LOOPBACK,
    port: int = 0,
    on_ready: Callable[[Mapping[str, Any]], None],
    keep_going: Callable[[], bool] = lambda: True,
) -> None:
    """Serve a simulated robot on ``host:port`` (0: any free port) until interrupted or ``keep_going()`` is false.

    ``on_ready`` is called once, when datagrams can come, with ``host, port, protocol, pid``. Raises HardwareError
    where the address cannot be used.
    """

    def build() -> SimulatedRobot:
        return SimulatedRobot(
            robot, game, imperfection=hardware.imperfection, control_period_s=hardware.control_period_s
        )

    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as line:
        try:
            line.bind((host, port))
        except (OSError, OverflowError) as error:
            raise HardwareError(f"the twin cannot listen on {host}:{port}: {error}; choose another port") from None
        watchdog_s = hardware.watchdog_s if hardware.realtime else hardware.silence_s
        server = RobotServer(
            lambda: RebuiltRobot(build),
            line,
            realtime=hardware.realtime,
            watchdog_s=watchdog_s,
            keep_going=keep_going,
        )
        bound, number = line.getsockname()
        on_ready({"host": bound, "port": number, "protocol": VERSION, "pid": os.getpid()})
        server.serve()
