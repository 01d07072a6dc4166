"""The simulated robot behind UDP: a twin of the real one, with a body that differs a little from the model.

A stop is latched: from then on the commander's datagrams are answered with STOPPED and its reason, and only a new
session (see seal.py), then RESET, leaves it. In lockstep the robot moves one control period per COMMAND and
knows no clock: a commander that says nothing may be suspended, and moves nothing. In real time it moves at every period
of the wall clock, brakes within its limits where no command came in time, counts that, and stops for good after
``watchdog_s`` of silence. A stop brakes too. Who has not the secret is ignored, and counted.
"""

from __future__ import annotations

import os
import socket
import time
from collections.abc import Callable, Mapping
from typing import Any

from kendama_cli.devices.robot.interface import JointCommand, Robot
from kendama_cli.devices.robot.rebuilt import rebuilt_robot
from kendama_cli.devices.robot.udp.commanded import CommandedRobot
from kendama_cli.devices.robot.udp.datagram_line import DatagramLine
from kendama_cli.devices.robot.udp.protocol import VERSION
from kendama_cli.errors import HardwareError
from kendama_cli.settings.game import GameSettings
from kendama_cli.settings.hardware import TwinHardware
from kendama_cli.settings.robot import RobotSettings

LOOPBACK = "127.0.0.1"
_CHECK_S = 0.5
"""How often a waiting server checks whether it should go on."""


def serve_twin(
    robot: RobotSettings,
    game: GameSettings,
    hardware: TwinHardware,
    secret: bytes,
    *,
    host: str = LOOPBACK,
    port: int = 0,
    on_ready: Callable[[Mapping[str, Any]], None],
    keep_going: Callable[[], bool] = lambda: True,
) -> None:
    """Serve a simulated robot on ``host:port`` (0: any free port) until interrupted or ``keep_going()`` is false.

    See ``serve_robot``.
    """
    serve_robot(
        lambda: rebuilt_robot(hardware, robot, game),
        secret,
        host=host,
        port=port,
        realtime=hardware.realtime,
        watchdog_s=hardware.watchdog_s,
        on_ready=on_ready,
        keep_going=keep_going,
    )


def serve_robot(
    open_robot: Callable[[], Robot],
    secret: bytes,
    *,
    host: str = LOOPBACK,
    port: int = 0,
    realtime: bool,
    watchdog_s: float,
    on_ready: Callable[[Mapping[str, Any]], None],
    keep_going: Callable[[], bool],
) -> None:
    """Serve the robot of ``open_robot`` on ``host:port`` until interrupted or ``keep_going()`` is false.

    Who has ``secret`` may command it. ``on_ready`` is called once, when datagrams can come, with ``host, port,
    protocol, pid``. Raises HardwareError where the address cannot be used.
    """
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as line:
        try:
            line.bind((host, port))
        except (OSError, OverflowError) as error:
            raise HardwareError(f"the robot cannot listen on {host}:{port}: {error}; choose another port") from None
        server = RobotServer(open_robot, line, secret, realtime=realtime, watchdog_s=watchdog_s, keep_going=keep_going)
        bound, number = line.getsockname()
        on_ready({"host": bound, "port": number, "protocol": VERSION, "pid": os.getpid()})
        server.serve()


class RobotServer:
    """Answers datagrams on ``line`` with what a robot does; ``serve`` returns when ``keep_going()`` is false.

    ``open_robot`` opens the robot, at once and again for every session after a stop, which no opened robot survives.
    """

    def __init__(
        self,
        open_robot: Callable[[], Robot],
        line: socket.socket,
        secret: bytes,
        *,
        realtime: bool,
        watchdog_s: float,
        keep_going: Callable[[], bool] = lambda: True,
    ) -> None:
        self._line = DatagramLine(line)
        self._commanded = CommandedRobot(open_robot, self._line, secret, realtime=realtime, watchdog_s=watchdog_s)
        self._realtime = realtime
        self._watchdog_s = watchdog_s
        self._keep_going = keep_going
        self._tick_s = 0.0

    @property
    def stopped(self) -> str | None:
        """Reason why the robot stands until a new session begins; None while one is open."""
        return self._commanded.session.stopped

    @property
    def ignored(self) -> int:
        """Number of datagrams that were no commander's, or came again."""
        return self._commanded.session.ignored

    def serve(self) -> None:
        """Answer until ``keep_going()`` is false; the robot is closed at the end."""
        try:
            while self._keep_going():
                if self._realtime and (self._commanded.moving or self._commanded.braking):
                    self._one_period()
                else:
                    self._one_answer()
        finally:
            self._commanded.robot.close()

    def _one_answer(self) -> None:
        received = self._line.receive(_CHECK_S)
        command = None if received is None else self._commanded.take(*received)
        if command is None:
            return
        if self._realtime:
            self._tick_s = time.monotonic()
        self._commanded.move(command)

    def _one_period(self) -> None:
        """Take what comes until the period is over, then move; nobody can keep it from ending by sending much."""
        period_s = self._commanded.robot.period_s
        self._tick_s = max(self._tick_s + period_s, time.monotonic() - period_s)
        fresh: JointCommand | None = None
        left_s = period_s
        while left_s > 0:
            left_s = self._tick_s - time.monotonic()
            received = self._line.receive(max(left_s, 0.0))
            if received is not None:
                taken = self._commanded.take(*received)
                self._commanded.session.missed += taken is not None and fresh is not None
                fresh = taken or fresh
            if not (self._commanded.moving or self._commanded.braking):
                return
        if fresh is not None and self._commanded.moving:
            self._commanded.move(fresh)
            return
        if self._commanded.moving:
            self._commanded.session.missed += 1
            if time.monotonic() - self._commanded.session.heard_s > self._watchdog_s:
                self._commanded.stop(f"no datagram came for {self._watchdog_s:g} s while moving")
        self._commanded.brake()
