"""Whatever the network does to datagrams, each command is carried out once and in order, or not at all."""

from __future__ import annotations

import dataclasses
import socket
import time

import numpy as np
import pytest

from kendama_cli.devices.robot.interface import Exchange, JointCommand
from kendama_cli.devices.robot.udp import protocol
from kendama_cli.devices.robot.udp.protocol import Datagram, Kind
from kendama_cli.devices.robot.udp.remote import UdpRobot
from kendama_cli.devices.robot.udp.seal import Seal
from kendama_cli.devices.robot.udp.twin import RobotServer
from kendama_cli.errors import HardwareError
from tests.devices.robot.stand_in import LOOPBACK, SECRET, ObedientRobot, Spoil, command, relayed, served

WHICH = 6
"""The datagram that is spoiled: HELLO is 0, OPEN 1, RESET 2, then commands."""


def drop(number: int, data: bytes) -> list[bytes]:
    return [] if number == WHICH else [data]


def drop_a_third(number: int, data: bytes) -> list[bytes]:
    return [] if number % 3 == 2 else [data]


def repeat(number: int, data: bytes) -> list[bytes]:
    return [data, data] if number == WHICH else [data]


def flip(number: int, data: bytes) -> list[bytes]:
    return [data[:40] + bytes([data[40] ^ 1]) + data[41:]] if number == WHICH else [data]


def cut(number: int, data: bytes) -> list[bytes]:
    return [data[:-8]] if number == WHICH else [data]


def rubbish(number: int, data: bytes) -> list[bytes]:
    return [b"GET / HTTP/1.1\r\nHost: kendama.example\r\n\r\n", data] if number == WHICH else [data]


class Late:
    """Keeps one datagram back and passes it on after the next one."""

    def __init__(self) -> None:
        self.kept: list[bytes] = []

    def __call__(self, number: int, data: bytes) -> list[bytes]:
        if number == WHICH - 1:
            self.kept = [data]
            return [data]
        return [data, *self.kept] if number == WHICH else [data]


class Again:
    """Passes everything on, and all of it once more at datagram ``WHICH``."""

    def __init__(self) -> None:
        self.heard: list[bytes] = []

    def __call__(self, number: int, data: bytes) -> list[bytes]:
        self.heard.append(data)
        return [*self.heard, data] if number == WHICH else [data]


def drive(address: tuple[str, int]) -> None:
    client = UdpRobot(*address, SECRET, silence_s=1.0)
    client.reset(np.zeros(2), 0)
    for k in range(12):
        assert client.exchange(command(0.01 * k)).state.position_rad[0] == 0.01 * k
    client.close()


def stands(server: RobotServer, within_s: float = 3.0) -> bool:
    until = time.monotonic() + within_s
    while server.stopped is None and time.monotonic() < until:
        time.sleep(0.01)
    return server.stopped is not None


SPOILS = [drop, drop_a_third, repeat, flip, cut, rubbish, Late(), Again()]
NAMES = ["drop", "drop_a_third", "repeat", "flip", "cut", "rubbish", "late", "all_again"]


@pytest.mark.parametrize("way", ["there", "back"])
@pytest.mark.parametrize("spoil", SPOILS, ids=NAMES)
def test_in_lockstep_a_spoiled_line_loses_and_repeats_no_command(spoil: Spoil, way: str) -> None:
    robot = ObedientRobot()
    with served(robot) as (server, address):
        with relayed(address, **{way: spoil}) as relay:
            drive(relay)
            assert stands(server)
        assert server.stopped == "the commander sent HALT"
    assert [float(one.position_rad[0]) for one in robot.carried_out] == [0.01 * k for k in range(12)]
    assert len(robot.resets) == 1


def test_a_number_that_was_skipped_stops_the_robot_in_lockstep() -> None:
    robot = ObedientRobot()
    with served(robot) as (server, address):
        client = UdpRobot(*address, SECRET, silence_s=1.0)
        client.reset(np.zeros(2), 0)
        client.exchange(command(0.1))
        client._line._counter += 1
        with pytest.raises(HardwareError, match="COMMAND 5 came where 4 was due: a datagram is lost") as caught:
            client.exchange(command(0.2))
        assert stands(server)
        assert "latched stop" in str(caught.value)
        assert "\n" not in str(caught.value)
        again = UdpRobot(*address, SECRET, silence_s=2.0)
        again.reset(np.zeros(2), 0)
        again.exchange(command(0.5))
        again.close()
    assert [float(one.position_rad[0]) for one in robot.carried_out] == [0.1, 0.5]
    assert robot.halts >= 1


def test_in_lockstep_a_silent_commander_moves_nothing_and_may_go_on() -> None:
    robot = ObedientRobot()
    with served(robot, watchdog_s=0.05) as (server, address):
        client = UdpRobot(*address, SECRET, silence_s=1.0)
        client.reset(np.zeros(2), 0)
        client.exchange(command(0.1))
        time.sleep(0.7)  # longer than the watchdog, and than the server's own wait
        assert server.stopped is None
        assert client.exchange(command(0.2)).t_s == pytest.approx(0.008)
        client.close()


def test_silence_of_the_robot_is_one_clear_error() -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as deaf:
        deaf.bind((LOOPBACK, 0))
        with pytest.raises(HardwareError, match=r"no answer to HELLO within 0\.3 s; has it the same key\?"):
            UdpRobot(*deaf.getsockname(), SECRET, silence_s=0.3)


def test_another_key_is_answered_by_silence_and_disturbs_nobody() -> None:
    robot = ObedientRobot()
    with served(robot) as (server, address):
        client = UdpRobot(*address, SECRET, silence_s=1.0)
        client.reset(np.zeros(2), 0)
        with pytest.raises(HardwareError, match=r"no answer to HELLO within 0\.3 s; has it the same key\?"):
            UdpRobot(*address, bytes(32), silence_s=0.3)
        assert server.ignored >= 1
        assert client.exchange(command(0.1)).state.position_rad[0] == 0.1
        client.close()


def test_a_robot_has_one_commander_until_that_lets_go() -> None:
    robot = ObedientRobot()
    with served(robot) as (_, address):
        first = UdpRobot(*address, SECRET, silence_s=1.0)
        first.reset(np.zeros(2), 0)
        with pytest.raises(HardwareError, match="another commander has it, and has not let go"):
            UdpRobot(*address, SECRET, silence_s=1.0)
        assert first.exchange(command(0.1)).state.position_rad[0] == 0.1
        first.close()
        second = UdpRobot(*address, SECRET, silence_s=1.0)
        second.reset(np.zeros(2), 0)
        second.close()


def test_a_commander_that_died_has_let_go() -> None:
    robot = ObedientRobot()
    with served(robot) as (_, address):
        first = UdpRobot(*address, SECRET, silence_s=1.0)
        first.reset(np.zeros(2), 0)
        first._line._peer.close()  # as kill -9 does: the socket ends, and nothing is said
        second = UdpRobot(*address, SECRET, silence_s=1.0)
        second.reset(np.zeros(2), 0)
        assert second.exchange(command(0.3)).state.position_rad[0] == 0.3
        second.close()


def test_a_robot_that_was_started_anew_does_not_know_the_session() -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as free:
        free.bind((LOOPBACK, 0))
        port = free.getsockname()[1]
    with served(ObedientRobot(), port=port) as (_, address):
        client = UdpRobot(*address, SECRET, silence_s=30.0)
        client.reset(np.zeros(2), 0)
    with (
        served(ObedientRobot(), port=port) as (server, address),
        pytest.raises(HardwareError, match="it knows this session no more: it was started anew, or took another"),
    ):
        client.exchange(command(0.1))
    assert not server._commanded.robot.carried_out  # type: ignore[attr-defined]


def test_a_robot_that_ends_while_it_is_waited_for_is_one_clear_error() -> None:
    with served(ObedientRobot()) as (_, address):
        client = UdpRobot(*address, SECRET, silence_s=30.0)
        client.reset(np.zeros(2), 0)
    with pytest.raises(HardwareError, match="nothing listens there; it is in a latched stop"):
        client.exchange(command(0.1))


def test_in_real_time_one_lost_datagram_is_counted_and_survived() -> None:
    robot = ObedientRobot()
    with served(robot, realtime=True, watchdog_s=2.0) as (server, address), relayed(address, there=drop) as relay:
        client = UdpRobot(*relay, SECRET, silence_s=3.0)
        client.reset(np.zeros(2), 0)
        for k in range(12):
            client.exchange(command(0.01 * k))
        assert server.stopped is None
        assert client.missed >= 1
        client.close()


def test_in_real_time_a_late_datagram_is_not_obeyed() -> None:
    robot = ObedientRobot()
    with served(robot, realtime=True, watchdog_s=2.0) as (server, address), relayed(address, there=Late()) as relay:
        drive(relay)
        assert stands(server)
        assert server.ignored == 1
    values = [float(one.position_rad[0]) for one in robot.carried_out]
    assert values == sorted(values)


def test_an_answer_of_the_robots_key_that_makes_no_sense_stops_it() -> None:
    class Lying(ObedientRobot):
        def exchange(self, command: JointCommand) -> Exchange:
            told = super().exchange(command)
            nothing = np.full(2, np.nan)
            return dataclasses.replace(told, state=dataclasses.replace(told.state, position_rad=nothing))

    with served(Lying()) as (server, address):
        client = UdpRobot(*address, SECRET, silence_s=1.0)
        client.reset(np.zeros(2), 0)
        with pytest.raises(HardwareError, match="STATE holds a value that is not finite; it is in a latched stop"):
            client.exchange(command(0.1))
        assert stands(server)


def test_a_command_that_is_no_number_stops_the_robot() -> None:
    robot = ObedientRobot()
    with served(robot) as (server, address):
        client = UdpRobot(*address, SECRET, silence_s=1.0)
        client.reset(np.zeros(2), 0)
        with pytest.raises(HardwareError, match="it stopped: COMMAND holds a value that is not finite"):
            client.exchange(command(float("nan")))
        assert stands(server)
    assert not robot.carried_out


def test_two_robots_never_talk_to_each_other() -> None:
    with served(ObedientRobot()) as (server, address), socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as line:
        line.settimeout(0.3)
        for kind in (Kind.STOPPED, Kind.STATE, Kind.CHALLENGE, Kind.WELCOME):
            line.sendto(Seal(SECRET).pack(Datagram(kind, 5, 1, protocol.pack_reason("?"))), address)
        with pytest.raises(TimeoutError):
            line.recv(4096)
        assert server.ignored == 4
