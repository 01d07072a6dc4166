"""An arm of six axes for RSI, and a controller that says whatever a test wants."""

from __future__ import annotations

import contextlib
import dataclasses
import re
import socket
import threading
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from kendama_cli.plugins.kuka_rsi.settings import RsiHardware
from kendama_cli.schema.settings import build_value
from kendama_cli.settings.game import GameSettings
from kendama_cli.settings.hardware import HardwareSettings
from kendama_cli.settings.robot import RobotSettings
from tests.shipped_conf import plain

LOOPBACK = "127.0.0.1"
GAME: GameSettings = build_value(GameSettings, plain("game", "kendama"), "game")
RSI: RsiHardware = dataclasses.replace(
    build_value(HardwareSettings, plain("hardware", "rsi"), "hardware"), host=LOOPBACK, controller=LOOPBACK, wait_s=5.0
)
LIMITS = '<limit lower="-2.9" upper="2.9" velocity="3.0" effort="200"/>'
INERTIA = '<inertial><mass value="2"/><inertia ixx=".02" iyy=".02" izz=".02" ixy="0" ixz="0" iyz="0"/></inertial>'
AXES = ("0 0 1", "0 1 0", "0 1 0", "0 0 1", "0 1 0", "0 0 1")


def six_axes(folder: Path) -> RobotSettings:
    """The settings of an arm whose description is written into ``folder``."""
    links = "".join(f'<link name="l{k}">{INERTIA}</link>' for k in range(7))
    joints = "".join(
        f'<joint name="a{k + 1}" type="revolute"><parent link="l{k}"/><child link="l{k + 1}"/>'
        f'<origin xyz="0 0 0.2"/><axis xyz="{axis}"/>{LIMITS}</joint>'
        for k, axis in enumerate(AXES)
    )
    urdf = folder / "six.urdf"
    urdf.write_text(f'<robot name="six">{links}{joints}</robot>')
    per_joint = {
        field.name: None
        for field in dataclasses.fields(RobotSettings)
        if "| None" in str(field.type) and "tuple" in str(field.type)
    }
    document: dict[str, Any] = {**plain("robot", "pa10"), **per_joint, "name": "six", "path": str(urdf)}
    document |= {"base_link": None, "tip_link": None, "locked_joints": []}
    return build_value(RobotSettings, document, "robot")


def free_port() -> int:
    """A UDP port that nobody has now."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as free:
        free.bind((LOOPBACK, 0))
        return int(free.getsockname()[1])


Said = Callable[[int, str], str | None]
"""From a cycle's number and the true telegram to what is sent; None: nothing."""


PATIENCE_S = 0.2
"""A true controller goes by its clock; this one waits, once it is answered, so that no load makes an answer late."""
UNANSWERED = 15
"""After so many cycles RSI ends, as on a true one."""
PAUSE_S = 0.1


class Controller:
    """A controller's end of RSI in a thread: carries out corrections, counts wrong IPOCs, may say what is not so."""

    def __init__(self, port: int, said: Said, cycle_ms: int, ends: bool, patience_s: float) -> None:
        self.to, self._said, self._cycle_ms = (LOOPBACK, port), said, cycle_ms
        self._ends, self._patience_s = ends, patience_s
        self.answers: list[tuple[int, tuple[float, ...]]] = []
        self.places: list[tuple[float, ...]] = []
        self.wrong = self.number = 0
        self.first_ipoc = 1000
        self.begun, self.over = threading.Event(), threading.Event()

    def serve(self) -> None:
        """Begin RSI again and again, from where the arm stands, as a program of the controller's does in a loop."""
        base, ipoc = (0.0,) * 6, self.first_ipoc
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as line:
            line.bind((LOOPBACK, 0))
            while not self.over.is_set():
                correction, ipoc = self._session(line, base, ipoc)
                base = tuple(a + b for a, b in zip(base, correction, strict=True))
                self.over.wait(PAUSE_S)
                ipoc += round(1e3 * PAUSE_S)

    def _session(self, line: socket.socket, base: tuple[float, ...], ipoc: int) -> tuple[tuple[float, ...], int]:
        """One RSI, until it is not answered; the last correction and the next time stamp."""
        correction, answered_once, unanswered, self.wrong = (0.0,) * 6, False, 0, 0
        while not self.over.is_set() and (unanswered < UNANSWERED or not self._ends):
            at = " ".join(f'A{k + 1}="{a + b:.5f}"' for k, (a, b) in enumerate(zip(base, correction, strict=True)))
            true = f'<Rob Type="KUKA"><AIPos {at}/><Delay D="{self.wrong}"/><IPOC>{ipoc}</IPOC></Rob>'
            text = self._said(self.number, true)
            if text is not None:
                line.sendto(text.encode(), self.to)
                self.begun.set()
            line.settimeout(self._patience_s if answered_once and unanswered == 0 else 1e-3 * self._cycle_ms)
            unanswered, self.wrong = unanswered + 1, self.wrong + 1
            with contextlib.suppress(TimeoutError, ConnectionError):
                told = -1
                while told != ipoc:  # an answer to an older telegram counts, and is not carried out
                    answer = line.recv(8192).decode()
                    (told,) = map(int, re.findall(r"<IPOC>(\d+)</IPOC>", answer))
                    answered = tuple(float(value) for value in re.findall(r'A\d="([^"]+)"', answer))
                    self.wrong += told != ipoc
                    self.answers.append((told, answered))
                self.places.append(tuple(a + b for a, b in zip(base, answered, strict=True)))
                correction, answered_once, unanswered, self.wrong = answered, True, 0, self.wrong - 1
            self.number += 1
            ipoc = (ipoc + self._cycle_ms) % 2**32
        return correction, ipoc


def truly(number: int, true: str) -> str | None:
    return true


@contextlib.contextmanager
def controller(
    port: int,
    said: Said = truly,
    cycle_ms: int = 4,
    *,
    ends: bool = True,
    patience_s: float = PATIENCE_S,
    first_ipoc: int = 1000,
) -> Iterator[Controller]:
    """A controller that sends to ``port`` of this machine, and ends RSI where nobody answers."""
    made = Controller(port, said, cycle_ms, ends, patience_s)
    made.first_ipoc = first_ipoc
    thread = threading.Thread(target=made.serve)
    thread.start()
    try:
        yield made
    finally:
        made.over.set()
        thread.join()
