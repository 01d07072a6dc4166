"""RSI against a program of others: the echo server of RSIPI, which keeps its own clock and refuses wrong answers."""

from __future__ import annotations

import contextlib
import dataclasses
import importlib.util
import subprocess
import sys
import venv
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from kendama_cli.devices.robot.open_robot import open_robot
from kendama_cli.errors import HardwareError
from kendama_cli.plugins.kuka_rsi.robot import open_rsi
from kendama_cli.plugins.suites.robot import CHECKS
from tests.plugins.kuka_rsi.six_axes import GAME, RSI, free_port, six_axes
from tests.plugins.kuka_rsi.test_rsi import swing
from tests.plugins.stalls import without_stall

pytestmark = pytest.mark.realtime

TELEGRAMS = Path(__file__).resolve().parents[3] / "examples" / "rsi" / "kendama_rsi.xml"
SERVE = """
import socket, sys, time
import RSIPI.rsi_echo_server as module

class Loopback(socket.socket):
    def bind(self, address):  # it would bind every address, and always the same port
        super().bind(("127.0.0.1", 0))

class Sockets:
    socket = Loopback
    def __getattr__(self, name):
        return getattr(socket, name)

module.socket = Sockets()
server = module.EchoServer(sys.argv[1], delay_ms=4, mode="absolute", timeout_packets=int(sys.argv[2]))
server.start()
while server.thread.is_alive():
    sys.stdin.readline()
    print("faulty", server.faulty_packets, flush=True)
"""


class Echo:
    """The running echo server."""

    def __init__(self, process: subprocess.Popen[str]) -> None:
        self._process = process

    def faulty(self) -> int:
        """How many answers it has refused or missed so far."""
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        self._process.stdin.write("\n")
        self._process.stdin.flush()
        while not (line := self._process.stdout.readline()).startswith("faulty"):
            assert line, "it ended"
        return int(line.split()[1])


@contextlib.contextmanager
def echo_server(python: str, port: int, folder: Path, timeout_packets: int = 100) -> Iterator[Echo]:
    """RSIPI's echo server, run by ``python``, which sends to ``port``."""
    telegrams = folder / "rsi.xml"
    text = TELEGRAMS.read_text().replace("10.10.10.10", "127.0.0.1").replace("64000", str(port))
    telegrams.write_text(text)
    process = subprocess.Popen(
        [python, "-c", SERVE, str(telegrams), str(timeout_packets)],
        cwd=folder,
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    )
    try:
        yield Echo(process)
    finally:
        process.kill()
        process.communicate()


@pytest.fixture(scope="module")
def python() -> str:
    """An interpreter that has RSIPI."""
    if importlib.util.find_spec("RSIPI") is None:
        pytest.skip("RSIPI is not here: pip install '.[test]'")
    return sys.executable


def play_on_echo(python: str, folder: Path) -> None:
    """A motion on RSIPI's controller: it does what it is answered in time, and what it refuses is counted as late.

    An answer that a stall of this machine made late brakes the arm, which another test is about: play once more then.
    """
    behind_rad = without_stall(lambda _: _behind(python, folder), LateError, HardwareError)
    assert behind_rad < np.radians(0.006)  # it reports hundredths of a degree


class LateError(Exception):
    """Answers came too late."""


def _behind(python: str, folder: Path) -> float:
    """How far the controller was from what was asked at most [rad]; raises LateError where an answer was late."""
    port = free_port()
    settings = dataclasses.replace(RSI, port=port, wait_s=30.0)
    with echo_server(python, port, folder) as echo, open_rsi(settings, six_axes(folder), GAME) as robot:
        robot.reset(np.full(6, 0.1), 0)
        robot.reset(np.zeros(6), 0)
        behind = np.array(swing(robot, span_s=1.0))
        assert len(behind) > 0
        end = robot.reset(np.full(6, 0.3), 0)
        assert np.abs(end.state.position_rad - 0.3).max() < np.radians(0.006)
        assert abs(robot.late - echo.faulty()) <= 1
        if robot.late:
            raise LateError(f"{robot.late} answers were late")
        return float(behind.max())


def test_a_motion_is_carried_out_by_anothers_controller(python: str, tmp_path: Path) -> None:
    play_on_echo(python, tmp_path)


@pytest.mark.slow
@pytest.mark.parametrize("check", CHECKS, ids=lambda check: check.__name__)
def test_on_anothers_controller_the_laws_of_a_robot_are_kept(check, python: str, tmp_path: Path) -> None:
    port = free_port()
    settings = dataclasses.replace(RSI, port=port, wait_s=30.0, approach_rad_s=2.0)
    with echo_server(python, port, tmp_path):
        check(lambda: open_robot(settings, six_axes(tmp_path), GAME))


@pytest.mark.slow
def test_the_same_with_rsipi_in_an_environment_of_its_own(tmp_path: Path) -> None:
    venv.create(tmp_path / "venv", with_pip=True)
    own = tmp_path / "venv" / "bin" / "python"
    installed = subprocess.run(
        [str(own), "-m", "pip", "install", "-q", "RSIPI==0.3.0"], capture_output=True, check=False
    )
    if installed.returncode != 0:
        pytest.skip(f"RSIPI cannot be installed here: {installed.stderr.decode().strip().splitlines()[-1]}")
    play_on_echo(str(own), tmp_path)
