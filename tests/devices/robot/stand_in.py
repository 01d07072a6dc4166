"""A robot of two joints without inertia, a server for it in a thread, and a relay that spoils the line."""

from __future__ import annotations

import socket
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np

from kendama_cli.devices.robot.interface import Exchange, JointCommand, RobotState
from kendama_cli.devices.robot.udp.twin import RobotServer
from kendama_cli.robot_model.limits import JointLimits
from kendama_cli.schema.arrays import Array

LOOPBACK = "127.0.0.1"
SECRET = bytes(range(32))


class ObedientRobot:
    """Is at once where it is told to be; remembers all commands it carried out."""

    joint_names = ("shoulder", "elbow")
    period_s = 0.004
    realtime = False
    missed = 0

    def __init__(self) -> None:
        ones = np.ones(2)
        self.limits = JointLimits(-3 * ones, 3 * ones, 2 * ones, 10 * ones, 50 * ones)
        self.carried_out: list[JointCommand] = []
        self.resets: list[tuple[Array, int]] = []
        self.halts = 0
        self.t_s = 0.0

    def exchange(self, command: JointCommand) -> Exchange:
        self.carried_out.append(command)
        self.t_s += self.period_s
        return self._at(command)

    def reset(self, position_rad: Array, seed: int) -> Exchange:
        self.resets.append((position_rad, seed))
        self.t_s = 0.0
        return self._at(JointCommand(position_rad, np.zeros(2), np.zeros(2)))

    def halt(self) -> None:
        self.halts += 1

    def close(self) -> None:
        self.halt()

    def _at(self, command: JointCommand) -> Exchange:
        place = np.array([command.position_rad[0], 0.0, command.position_rad[1]])
        state = RobotState(
            command.position_rad, command.velocity_rad_s, np.zeros(2), np.zeros(6), place, place - 0.4, False
        )
        return Exchange(command, state, self.t_s)


def key_file(folder: Path) -> Path:
    """A file with the key SECRET."""
    file = folder / "robot.key"
    file.write_text(SECRET.hex() + "\n")
    file.chmod(0o600)
    return file


def command(value: float) -> JointCommand:
    return JointCommand(np.full(2, value), np.zeros(2), np.zeros(2))


@contextmanager
def served(
    robot: ObedientRobot, *, realtime: bool = False, watchdog_s: float = 5.0, port: int = 0
) -> Iterator[tuple[RobotServer, tuple[str, int]]]:
    """A server for ``robot`` in a thread of its own, and its address."""
    over = threading.Event()
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as line:
        line.bind((LOOPBACK, port))
        server = RobotServer(
            lambda: robot, line, SECRET, realtime=realtime, watchdog_s=watchdog_s, keep_going=lambda: not over.is_set()
        )
        thread = threading.Thread(target=server.serve)
        thread.start()
        try:
            yield server, line.getsockname()
        finally:
            over.set()
            with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as waker:
                waker.sendto(b"", line.getsockname())
            thread.join()


Spoil = Callable[[int, bytes], list[bytes]]
"""From a datagram's number (from 0) and its bytes to what is passed on instead."""


def faithful(number: int, data: bytes) -> list[bytes]:
    return [data]


@contextmanager
def relayed(address: tuple[str, int], *, there: Spoil = faithful, back: Spoil = faithful) -> Iterator[tuple[str, int]]:
    """A relay to ``address`` that passes each way through a function; its own address."""
    over = threading.Event()
    with (
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as inner,
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as outer,
    ):
        inner.bind((LOOPBACK, 0))
        outer.bind((LOOPBACK, 0))
        client: list[tuple[str, int]] = []

        def run(source: socket.socket, spoil: Spoil, send: Callable[[bytes], object]) -> None:
            source.settimeout(0.05)
            number = 0
            while not over.is_set():
                try:
                    data, sender = source.recvfrom(65536)
                except (TimeoutError, ConnectionError):
                    continue
                if source is inner:
                    client[:] = [sender]
                for passed in spoil(number, data):
                    send(passed)
                number += 1

        threads = [
            threading.Thread(target=run, args=(inner, there, lambda data: outer.sendto(data, address))),
            threading.Thread(target=run, args=(outer, back, lambda data: inner.sendto(data, client[0]))),
        ]
        for thread in threads:
            thread.start()
        try:
            yield inner.getsockname()
        finally:
            over.set()
            for thread in threads:
                thread.join()
