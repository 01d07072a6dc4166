"""The twin as a process: reproducible, never an orphan, and clear when it cannot start."""

from __future__ import annotations

import dataclasses
import json
import os
import signal
import subprocess
import sys
import textwrap
import threading
import time
from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path

import numpy as np
import pytest

from kendama_cli.devices.robot.interface import Exchange, JointCommand
from kendama_cli.devices.robot.open_robot import open_robot
from kendama_cli.devices.robot.udp.remote import UdpRobot
from kendama_cli.devices.robot.udp.twin import serve_twin
from kendama_cli.devices.robot.udp.twin_client import settings_document
from kendama_cli.errors import HardwareError
from kendama_cli.plugins.suites.robot import CHECKS
from kendama_cli.settings.game import GameSettings
from kendama_cli.settings.hardware import CommandHardware, HardwareSettings, TwinHardware
from kendama_cli.settings.robot import RobotSettings
from tests.devices.robot.stand_in import SECRET, key_file
from tests.shipped_conf import configured

ROOT = Path(__file__).resolve().parents[2]


GAME: GameSettings = configured(GameSettings, "game", "kendama")
ROBOT: RobotSettings = configured(RobotSettings, "robot", "pa10")
TWIN: TwinHardware = configured(HardwareSettings, "hardware", "twin")


def alive(pid: int) -> bool:
    try:
        return Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()[0] != "Z"
    except FileNotFoundError:
        return False


def gone(pid: int, within_s: float = 10.0) -> bool:
    until = time.monotonic() + within_s
    while alive(pid) and time.monotonic() < until:
        time.sleep(0.02)
    return not alive(pid)


def twin_pid() -> int:
    """The process of the twin that was begun last among this one's children."""
    children = [int(p) for f in Path("/proc/self/task").glob("*/children") for p in f.read_text().split()]
    twins = [p for p in children if b"twin_client" in Path(f"/proc/{p}/cmdline").read_bytes()]
    return max(twins, key=lambda pid: int(Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()[19]))


@contextmanager
def started() -> Iterator[tuple[subprocess.Popen[bytes], tuple[str, int]]]:
    """A twin that listens, and where."""
    process = subprocess.Popen(
        [sys.executable, "-m", "kendama_cli.devices.robot.udp.twin_client"],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
    )
    assert process.stdin is not None
    assert process.stdout is not None
    process.stdin.write(f"{SECRET.hex()}\n{settings_document(ROBOT, GAME, TWIN)}\n".encode())
    process.stdin.flush()
    ready = json.loads(process.stdout.readline())
    try:
        yield process, (ready["host"], ready["port"])
    finally:
        process.kill()
        process.wait()
        process.stdout.close()
        process.stdin.close()


@pytest.fixture(scope="module")
def twin() -> Iterator[tuple[subprocess.Popen[bytes], tuple[str, int]]]:
    """One twin for all tests that leave it as it was: sessions follow each other."""
    with started() as made:
        yield made


def session(robot: UdpRobot, seed: int) -> list[Exchange]:
    home = np.array(ROBOT.home_rad)
    told = [robot.reset(home, seed)]
    for k in range(100):
        sway = 0.05 * np.sin(0.05 * k) * np.ones(len(home))
        told.append(robot.exchange(JointCommand(home + sway, np.zeros(len(home)), np.zeros(len(home)))))
    return told


def as_bytes(told: list[Exchange]) -> bytes:
    parts = []
    for one in told:
        state = one.state
        parts += [one.sent.position_rad, state.position_rad, state.velocity_rad_s, state.effort_nm]
        parts += [state.cup_in_world_m, state.ball_in_world_m, np.array([one.t_s])]
    return np.concatenate(parts).tobytes()


def test_two_processes_and_a_second_session_tell_the_same_bytes() -> None:
    told = []
    for _ in range(2):
        with open_robot(TWIN, ROBOT, GAME) as robot:
            told += [as_bytes(session(robot, 5)), as_bytes(session(robot, 6)), as_bytes(session(robot, 5))]
    assert told[0] == told[2] == told[3] == told[5]
    assert told[1] == told[4] != told[0]


def test_the_twin_listens_on_loopback_only(twin: tuple[subprocess.Popen[bytes], tuple[str, int]]) -> None:
    assert twin[1][0] == "127.0.0.1"


def test_a_new_session_follows_a_stopped_one_on_the_same_twin(
    twin: tuple[subprocess.Popen[bytes], tuple[str, int]],
) -> None:
    first = UdpRobot(*twin[1], SECRET, silence_s=10.0)
    before = as_bytes(session(first, 5))
    first.close()
    second = UdpRobot(*twin[1], SECRET, silence_s=10.0)
    assert as_bytes(session(second, 5)) == before
    second.close()


def test_the_twin_ends_when_its_input_closes() -> None:
    with started() as (process, _):
        assert process.stdin is not None
        process.stdin.close()
        assert process.wait(10.0) == 0


def test_kill_9_of_the_commander_leaves_no_orphan(tmp_path: Path) -> None:
    script = tmp_path / "commander.py"
    script.write_text(
        textwrap.dedent("""
        import time
        from kendama_cli.devices.robot.open_robot import open_robot
        from tests.faults.test_twin_process import GAME, ROBOT, TWIN, session, twin_pid
        with open_robot(TWIN, ROBOT, GAME) as robot:
            session(robot, 1)
            print(twin_pid(), flush=True)
            time.sleep(60)
        """)
    )
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    commander = subprocess.Popen([sys.executable, str(script)], stdout=subprocess.PIPE, env=environment)
    assert commander.stdout is not None
    pid = int(commander.stdout.readline())
    assert alive(pid)
    commander.send_signal(signal.SIGKILL)
    commander.wait()
    commander.stdout.close()
    assert gone(pid)


def test_kill_9_of_the_twin_while_it_is_commanded_is_one_clear_error() -> None:
    with open_robot(TWIN, ROBOT, GAME) as robot:
        session(robot, 1)
        pid = twin_pid()
        os.kill(pid, signal.SIGKILL)
        with pytest.raises(HardwareError, match="the twin's process was killed by signal 9") as caught:
            session(robot, 2)
        assert "\n" not in str(caught.value)


def test_in_lockstep_a_suspended_twin_is_waited_for() -> None:
    patient = dataclasses.replace(TWIN, silence_s=0.2, watchdog_s=0.2)
    with open_robot(patient, ROBOT, GAME) as robot:
        told = as_bytes(session(robot, 1))
        pid = twin_pid()
        os.kill(pid, signal.SIGSTOP)
        threading.Timer(2.5, os.kill, (pid, signal.SIGCONT)).start()
        begin = time.monotonic()
        assert as_bytes(session(robot, 1)) == told
        assert time.monotonic() - begin > 2.0


def test_in_lockstep_a_suspended_commander_goes_on(tmp_path: Path) -> None:
    script = tmp_path / "commander.py"
    script.write_text(
        textwrap.dedent("""
        import dataclasses
        from kendama_cli.devices.robot.open_robot import open_robot
        from tests.faults.test_twin_process import GAME, ROBOT, TWIN, session, as_bytes
        with open_robot(dataclasses.replace(TWIN, silence_s=0.2, watchdog_s=0.2), ROBOT, GAME) as robot:
            told = as_bytes(session(robot, 1))
            print("moving", flush=True)
            for _ in range(2):
                assert as_bytes(session(robot, 1)) == told
        """)
    )
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    commander = subprocess.Popen([sys.executable, str(script)], stdout=subprocess.PIPE, env=environment)
    assert commander.stdout is not None
    assert commander.stdout.readline() == b"moving\n"
    time.sleep(0.05)
    commander.send_signal(signal.SIGSTOP)
    time.sleep(1.5)
    commander.send_signal(signal.SIGCONT)
    assert commander.wait() == 0
    commander.stdout.close()


def test_a_twin_that_cannot_start_says_why(tmp_path: Path) -> None:
    broken = tmp_path / "broken.urdf"
    broken.write_text("<robot")
    robot = dataclasses.replace(ROBOT, path=str(broken))
    with (
        pytest.raises(HardwareError, match="the twin did not start: the twin's process ended with exit code") as caught,
        open_robot(TWIN, robot, GAME),
    ):
        pass
    assert "broken.urdf" in str(caught.value)
    assert "\n" not in str(caught.value)


def test_without_settings_the_process_says_what_it_needs() -> None:
    done = subprocess.run(
        [sys.executable, "-m", "kendama_cli.devices.robot.udp.twin_client"],
        input=b"",
        capture_output=True,
        check=False,
    )
    assert done.returncode == 2
    assert b"needs secret and settings, a line each, on standard input" in done.stderr


def test_a_port_that_is_taken_is_one_clear_error(twin: tuple[subprocess.Popen[bytes], tuple[str, int]]) -> None:
    host, port = twin[1]
    with pytest.raises(HardwareError, match=f"the robot cannot listen on {host}:{port}: .*; choose another port"):
        serve_twin(ROBOT, GAME, TWIN, SECRET, host=host, port=port, on_ready=lambda ready: None)


def test_a_robot_that_already_listens_is_played_through_its_address(
    twin: tuple[subprocess.Popen[bytes], tuple[str, int]], tmp_path: Path
) -> None:
    host, port = twin[1]
    with open_robot(CommandHardware("command", host, port, str(key_file(tmp_path)), 10.0), ROBOT, GAME) as robot:
        assert len(session(robot, 3)) == 101
    assert CommandHardware.moves
    assert not getattr(TwinHardware, "moves", False)


def test_the_robot_behind_udp_keeps_the_laws_of_its_interface(
    twin: tuple[subprocess.Popen[bytes], tuple[str, int]],
) -> None:
    """Each law in a session of its own, on one twin."""

    @contextmanager
    def begun() -> Iterator[UdpRobot]:
        with closing(UdpRobot(*twin[1], SECRET, silence_s=10.0)) as robot:
            robot.reset(np.array(ROBOT.home_rad), 0)
            yield robot

    for check in CHECKS:
        check(begun)
