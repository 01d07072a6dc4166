"""The UDP line in lockstep and in real time, with a robot that has no dynamics."""

from __future__ import annotations

import importlib.util
import socket
import sys
import threading
import time
from pathlib import Path

import numpy as np
import pytest

from kendama_cli.devices.robot.interface import JointCommand
from kendama_cli.devices.robot.udp import commander_line
from kendama_cli.devices.robot.udp.remote import UdpRobot
from kendama_cli.errors import HardwareError
from tests.devices.robot.stand_in import LOOPBACK, SECRET, ObedientRobot, command, served


def test_the_handshake_says_what_the_robot_is() -> None:
    robot = ObedientRobot()
    with served(robot) as (_, address):
        client = UdpRobot(*address, SECRET, silence_s=5.0)
        assert client.joint_names == robot.joint_names
        assert client.period_s == robot.period_s
        assert not client.realtime
        assert np.array_equal(client.limits.upper_rad, robot.limits.upper_rad)
        client.close()


def test_in_lockstep_every_command_is_carried_out_once_and_in_order() -> None:
    robot = ObedientRobot()
    with served(robot) as (_, address):
        client = UdpRobot(*address, SECRET, silence_s=5.0)
        client.reset(np.array([0.5, -0.5]), 42)
        for k in range(200):
            exchange = client.exchange(command(k / 100))
            assert exchange.t_s == pytest.approx((k + 1) * 0.004)
            assert exchange.state.position_rad[0] == k / 100
        client.close()
    assert [float(c.position_rad[1]) for c in robot.carried_out] == [k / 100 for k in range(200)]
    assert robot.resets[0][1] == 42
    assert client.missed == 0


def test_in_lockstep_the_robot_waits_between_commands() -> None:
    robot = ObedientRobot()
    with served(robot) as (_, address):
        client = UdpRobot(*address, SECRET, silence_s=5.0)
        client.reset(np.zeros(2), 0)
        client.exchange(command(0.1))
        time.sleep(0.1)
        assert client.exchange(command(0.2)).t_s == pytest.approx(0.008)
        client.close()


def test_a_halted_robot_answers_nothing_but_the_reason_until_a_new_session() -> None:
    robot = ObedientRobot()
    with served(robot) as (server, address):
        client = UdpRobot(*address, SECRET, silence_s=5.0)
        client.reset(np.zeros(2), 0)
        client.halt()
        client.halt()
        with pytest.raises(HardwareError, match="halted from here"):
            client.exchange(command(0.1))
        client.close()
        again = UdpRobot(*address, SECRET, silence_s=5.0)
        again.reset(np.zeros(2), 0)
        assert again.exchange(command(0.3)).state.position_rad[0] == 0.3
        assert server.stopped is None
        again.close()
    assert len(robot.carried_out) == 1
    assert robot.halts >= 1


def test_nobody_at_the_other_end_is_one_clear_error() -> None:
    with pytest.raises(HardwareError, match=r"the robot at 127\.0\.0\.1:9: nothing listens there"):
        UdpRobot(LOOPBACK, 9, SECRET, silence_s=0.5)


def test_an_unknown_host_is_one_clear_error() -> None:
    with pytest.raises(HardwareError, match="cannot be reached"):
        UdpRobot("no.such.host.invalid", 9, SECRET, silence_s=0.5)


def test_a_dead_process_is_reported_by_its_exit_reason() -> None:
    with pytest.raises(HardwareError, match="was killed by signal 9"):
        UdpRobot(LOOPBACK, 9, SECRET, silence_s=5.0, exit_reason=lambda: "the twin's process was killed by signal 9")


def test_a_command_before_the_first_reset_latches_the_stop() -> None:
    robot = ObedientRobot()
    with served(robot) as (_, address):
        client = UdpRobot(*address, SECRET, silence_s=5.0)
        with pytest.raises(HardwareError, match="COMMAND came before the first RESET"):
            client.exchange(command(0.1))
        client.close()
    assert not robot.carried_out


def test_a_robot_that_fails_says_why() -> None:
    class Failing(ObedientRobot):
        def exchange(self, command: object) -> object:  # type: ignore[override]
            raise HardwareError("joint 'elbow' is at its position limit")

    with served(Failing()) as (server, address):
        client = UdpRobot(*address, SECRET, silence_s=5.0)
        client.reset(np.zeros(2), 0)
        with pytest.raises(HardwareError, match="it stopped: joint 'elbow' is at its position limit"):
            client.exchange(command(0.1))
        assert server.stopped is not None
        client.close()


def test_in_real_time_the_wall_clock_paces_the_robot() -> None:
    robot = ObedientRobot()
    with served(robot, realtime=True, watchdog_s=2.0) as (_, address):
        client = UdpRobot(*address, SECRET, silence_s=5.0)
        assert client.realtime
        client.reset(np.zeros(2), 0)
        begin = time.monotonic()
        for k in range(50):
            last = client.exchange(command(k / 100))
        took = time.monotonic() - begin
        client.close()
    assert took >= 49 * robot.period_s * 0.9
    assert last.state.position_rad[0] == 0.49


def test_in_real_time_a_missed_period_of_a_robot_at_rest_keeps_it_there_and_is_counted() -> None:
    robot = ObedientRobot()
    with served(robot, realtime=True, watchdog_s=5.0) as (_, address):
        client = UdpRobot(*address, SECRET, silence_s=5.0)
        client.reset(np.zeros(2), 0)
        client.exchange(command(0.1))
        client.exchange(command(0.2))
        time.sleep(10 * robot.period_s)
        client.exchange(command(0.3))
        missed = client.missed
        client.close()
    assert missed >= 5
    values = [float(c.position_rad[0]) for c in robot.carried_out]
    assert values.count(0.2) >= 5
    assert values == sorted(values)


def test_in_real_time_silence_while_moving_latches_the_stop() -> None:
    robot = ObedientRobot()
    with served(robot, realtime=True, watchdog_s=0.1) as (server, address):
        client = UdpRobot(*address, SECRET, silence_s=5.0)
        client.reset(np.zeros(2), 0)
        client.exchange(command(0.1))
        time.sleep(0.6)
        assert server.stopped is not None
        with pytest.raises(HardwareError, match=r"no datagram came for 0\.1 s while moving"):
            client.exchange(command(0.2))
        client.close()
    assert robot.halts >= 1


def test_a_robot_at_rest_does_not_mind_silence() -> None:
    robot = ObedientRobot()
    with served(robot, realtime=True, watchdog_s=0.05) as (_, address):
        client = UdpRobot(*address, SECRET, silence_s=5.0)
        client.reset(np.zeros(2), 0)
        time.sleep(0.3)
        client.exchange(command(0.1))
        client.close()


def fast(robot: ObedientRobot, client: UdpRobot, speed: float = 2.0) -> None:
    """Have the robot move at ``speed``, the limit of both joints."""
    client.reset(np.zeros(2), 0)
    for k in range(1, 6):
        client.exchange(JointCommand(np.full(2, speed * robot.period_s * k), np.full(2, speed), np.zeros(2)))


@pytest.mark.parametrize("ends", ["silence", "halt", "nonsense"])
def test_in_real_time_a_robot_whose_commander_has_gone_brakes_within_its_limits(ends: str) -> None:
    # of constant deceleration a = 10 rad/s^2 from v = 2 rad/s: v / a = 0.2 s and v^2 / 2 a = 0.2 rad
    robot = ObedientRobot()
    with served(robot, realtime=True, watchdog_s=0.1) as (server, address):
        client = UdpRobot(*address, SECRET, silence_s=5.0)
        fast(robot, client)
        if ends == "halt":
            client.halt()
        elif ends == "nonsense":
            with pytest.raises(HardwareError, match="not finite"):
                client.exchange(JointCommand(np.full(2, np.nan), np.zeros(2), np.zeros(2)))
        until_s = time.monotonic() + 10
        while robot.halts == 0 and time.monotonic() < until_s:
            time.sleep(0.05)
        assert server.stopped is not None
        client.close()
    speeds = np.array([one.velocity_rad_s[0] for one in robot.carried_out])
    places = np.array([one.position_rad[0] for one in robot.carried_out])
    braking = int(np.flatnonzero(speeds >= 2.0)[-1])
    assert speeds[-1] == 0.0
    assert np.abs(np.diff(speeds[braking:]) / robot.period_s).max() <= 10.0 * (1 + 1e-9)
    assert places[-1] - places[braking] == pytest.approx(0.2, abs=2.0 * robot.period_s)
    assert np.abs(np.diff(places[braking:]) / robot.period_s).max() <= 2.0 * (1 + 1e-9)


def test_a_robot_that_was_braked_continues_with_its_commander() -> None:
    robot = ObedientRobot()
    with served(robot, realtime=True, watchdog_s=20.0) as (server, address):
        client = UdpRobot(*address, SECRET, silence_s=5.0)
        fast(robot, client)
        time.sleep(0.5)
        there = robot.carried_out[-1].position_rad
        done = client.exchange(JointCommand(there, np.zeros(2), np.zeros(2)))
        assert np.array_equal(done.state.position_rad, there)
        assert server.stopped is None
        client.close()


class _Silent(threading.Thread):
    """A controller that takes a RESET and never answers it, or nothing at all."""

    def __init__(self, *, welcomes: bool) -> None:
        super().__init__(daemon=True)
        self.over, self._welcomes = threading.Event(), welcomes
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as free:
            free.bind((LOOPBACK, 0))
            self.address = free.getsockname()
        folder = Path(__file__).resolve().parents[4] / "examples" / "controller" / "kendama_robot.py"
        spec = importlib.util.spec_from_file_location("kendama_robot", folder)
        assert spec is not None
        assert spec.loader is not None
        library = sys.modules["kendama_robot"] = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(library)
        limits = ((-1.0,), (1.0,), (1.0,), (1.0,), (1.0,))
        about = library.Description(("a",), limits, 0.004, 1.0, realtime=False)
        self.robot = library.Robot(self.address[1], SECRET, about)

    def run(self) -> None:
        while not self.over.is_set():
            if self._welcomes:
                self.robot.poll(0.05)
            time.sleep(0.01)


@pytest.mark.parametrize("welcomes", [True, False], ids=["a_reset_that_never_ends", "a_process_that_says_nothing"])
def test_nobody_is_waited_for_without_a_limit(welcomes: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(commander_line, "MAX_WAIT_S", 1.0)
    controller = _Silent(welcomes=welcomes)
    controller.start()
    try:
        with pytest.raises(HardwareError, match=r"no answer to (RESET 2|HELLO) within 1 s"):
            UdpRobot(*controller.address, SECRET, silence_s=60.0, exit_reason=lambda: None).reset(np.zeros(1), 0)
    finally:
        controller.over.set()
        controller.join()
        controller.robot.line.close()
