"""Every fault of the line ends in a latched stop on the robot's side and one clear line on ours."""

from __future__ import annotations

import socket
import time
from collections.abc import Callable

import numpy as np
import pytest

from kendama_cli.devices.robot import protocol
from kendama_cli.devices.robot.protocol import Datagram, Kind
from kendama_cli.devices.robot.remote import UdpRobot
from kendama_cli.devices.robot.server import RobotServer
from kendama_cli.errors import HardwareError
from tests.devices.robot.stand_in import LOOPBACK, ObedientRobot, Spoil, command, relayed, served

WHICH = 5
"""The datagram that is spoiled: HELLO is 0, RESET 1, then commands."""


def drop(number: int, data: bytes) -> list[bytes]:
    return [] if number == WHICH else [data]


def repeat(number: int, data: bytes) -> list[bytes]:
    return [data, data] if number == WHICH else [data]


def flip(number: int, data: bytes) -> list[bytes]:
    return [data[:40] + bytes([data[40] ^ 1]) + data[41:]] if number == WHICH else [data]


def cut(number: int, data: bytes) -> list[bytes]:
    return [data[:-8]] if number == WHICH else [data]


def rubbish(number: int, data: bytes) -> list[bytes]:
    return [b"GET / HTTP/1.1\r\nHost: kendama.example\r\n\r\n", data] if number == WHICH else [data]


def other_session(number: int, data: bytes) -> list[bytes]:
    if number != WHICH:
        return [data]
    whole = protocol.unpack(data)
    return [protocol.pack(Datagram(whole.kind, whole.session ^ 1, whole.sequence, whole.payload))]


class Late:
    """Keeps one datagram back and passes it on after the next one."""

    def __init__(self) -> None:
        self.kept: list[bytes] = []

    def __call__(self, number: int, data: bytes) -> list[bytes]:
        if number == WHICH - 1:
            self.kept = [data]
            return [data]
        return [data, *self.kept] if number == WHICH else [data]


def drive(address: tuple[str, int], silence_s: float = 1.0) -> None:
    client = UdpRobot(*address, silence_s=silence_s)
    try:
        client.reset(np.zeros(2), 0)
        for k in range(12):
            client.exchange(command(0.01 * k))
    finally:
        with pytest.raises(HardwareError):
            client.exchange(command(9.0))
        client.close()


def stands(server: RobotServer, within_s: float = 3.0) -> bool:
    until = time.monotonic() + within_s
    while server.stopped is None and time.monotonic() < until:
        time.sleep(0.01)
    return server.stopped is not None


@pytest.mark.parametrize(
    ("spoil", "says"),
    [
        (drop, "no answer to COMMAND 5 within 1 s"),
        (repeat, "COMMAND 5 came late or again; 6 was due"),
        (flip, "CRC-32 does not fit"),
        (cut, "bytes of payload where the header announces"),
        (rubbish, "begins with b'GET '"),
        (other_session, "of another session came"),
        (Late(), "COMMAND 4 came late or again"),
    ],
    ids=["drop", "repeat", "flip", "cut", "rubbish", "other_session", "late"],
)
def test_a_spoiled_command_is_never_acted_on_and_stops_the_robot(spoil: Spoil, says: str) -> None:
    robot = ObedientRobot()
    with served(robot) as (server, address):
        with relayed(address, there=spoil) as relay:
            with pytest.raises(HardwareError, match=says) as caught:
                drive(relay)
            assert stands(server)
        carried_out = [float(c.position_rad[0]) for c in robot.carried_out]
        assert carried_out == [0.01 * k for k in range(len(carried_out))], "carried out once, in order, none skipped"
        assert len(carried_out) <= WHICH
        assert "\n" not in str(caught.value)
        assert "latched stop" in str(caught.value)
        again = UdpRobot(*address, silence_s=2.0)
        again.reset(np.zeros(2), 0)
        again.exchange(command(0.5))
        again.close()
    assert robot.halts >= 1


@pytest.mark.parametrize(
    ("spoil", "says"),
    [
        (drop, "no answer to COMMAND 5 within 1 s"),
        (repeat, "STATE 5 came late or again where STATE 6 was due"),
        (flip, "CRC-32 does not fit"),
        (cut, "bytes of payload where the header announces"),
        (rubbish, "begins with b'GET '"),
        (other_session, "an answer of another session came"),
        (Late(), "STATE 4 came late or again"),
    ],
    ids=["drop", "repeat", "flip", "cut", "rubbish", "other_session", "late"],
)
def test_a_spoiled_answer_stops_the_robot_too(spoil: Spoil, says: str) -> None:
    robot = ObedientRobot()
    with served(robot) as (server, address), relayed(address, back=spoil) as relay:
        with pytest.raises(HardwareError, match=says):
            drive(relay)
        assert stands(server)


def test_a_skipped_number_stops_the_robot() -> None:
    robot = ObedientRobot()
    with served(robot) as (server, address):
        client = UdpRobot(*address, silence_s=1.0)
        client.reset(np.zeros(2), 0)
        client.exchange(command(0.1))
        client._sequence += 1
        with pytest.raises(HardwareError, match="COMMAND 4 came where 3 was due: a datagram is lost"):
            client.exchange(command(0.2))
        assert stands(server)
    assert len(robot.carried_out) == 1


def test_silence_of_the_commander_stops_the_robot() -> None:
    robot = ObedientRobot()
    with served(robot, watchdog_s=0.2) as (server, address):
        client = UdpRobot(*address, silence_s=1.0)
        client.reset(np.zeros(2), 0)
        client.exchange(command(0.1))
        assert stands(server)
        with pytest.raises(HardwareError, match=r"it stopped: no datagram came for 0\.2 s while moving"):
            client.exchange(command(0.2))


def test_silence_of_the_robot_is_one_clear_error() -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as deaf:
        deaf.bind((LOOPBACK, 0))
        with pytest.raises(HardwareError, match=r"no answer to HELLO 0 within 0\.3 s"):
            UdpRobot(*deaf.getsockname(), silence_s=0.3)


def _foreign_command(session: int) -> bytes:
    return protocol.pack(Datagram(Kind.COMMAND, session, 2, protocol.pack_command(command(3.0))))


@pytest.mark.parametrize(
    ("said", "says"),
    [
        (_foreign_command, "a foreign COMMAND came from"),
        (lambda session: protocol.pack(Datagram(Kind.HALT, session, 2)), "a foreign HALT came from"),
        (lambda session: protocol.pack(Datagram(Kind.HELLO, session + 1, 0)), "the HELLO of another session"),
        (lambda session: protocol.pack(Datagram(Kind.HELLO, session, 0)), "a repeated HELLO"),
        (lambda session: b"hello?", "malformed datagram of 6 bytes"),
        (lambda session: protocol.pack(Datagram(Kind.STATE, session, 2)), "where only commands belong"),
    ],
    ids=["command", "halt", "hello", "same_hello", "rubbish", "state"],
)
def test_a_foreign_sender_moves_nothing_and_stops_the_robot(said: Callable[[int], bytes], says: str) -> None:
    robot = ObedientRobot()
    with served(robot) as (server, address), socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as foreign:
        client = UdpRobot(*address, silence_s=1.0, session=1000)
        client.reset(np.zeros(2), 0)
        foreign.sendto(said(1000), address)
        assert stands(server)
        with pytest.raises(HardwareError, match=says):
            client.exchange(command(0.1))
    assert not robot.carried_out


def test_an_old_session_cannot_be_begun_again() -> None:
    robot = ObedientRobot()
    with served(robot) as (_, address):
        UdpRobot(*address, silence_s=1.0, session=77).close()
        with pytest.raises(HardwareError, match="it stopped: the commander sent HALT"):
            UdpRobot(*address, silence_s=1.0, session=77)


def test_a_stopped_robot_answers_every_datagram_with_its_reason() -> None:
    robot = ObedientRobot()
    with served(robot) as (_, address), socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as line:
        line.settimeout(2.0)
        for data in (b"?", protocol.pack(Datagram(Kind.COMMAND, 5, 1)), protocol.pack(Datagram(Kind.HALT, 5, 2))):
            line.sendto(data, address)
            answer = protocol.unpack(line.recv(4096))
            assert answer.kind is Kind.STOPPED
            assert protocol.unpack_reason(answer.payload) == "no session has begun"


def test_two_robots_never_talk_to_each_other() -> None:
    robot = ObedientRobot()
    with served(robot) as (_, address), socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as line:
        line.settimeout(0.3)
        line.sendto(protocol.pack(Datagram(Kind.STOPPED, 5, 1)), address)
        with pytest.raises(TimeoutError):
            line.recv(4096)


def test_in_real_time_one_lost_datagram_is_counted_and_survived() -> None:
    robot = ObedientRobot()
    with served(robot, realtime=True, watchdog_s=2.0) as (server, address), relayed(address, there=drop) as relay:
        client = UdpRobot(*relay, silence_s=3.0)
        client.reset(np.zeros(2), 0)
        for k in range(12):
            client.exchange(command(0.01 * k))
        assert server.stopped is None
        assert client.missed >= 1
        client.close()


def test_in_real_time_a_late_datagram_stops_the_robot() -> None:
    robot = ObedientRobot()
    with served(robot, realtime=True, watchdog_s=2.0) as (server, address), relayed(address, there=Late()) as relay:
        with pytest.raises(HardwareError, match="came late or again"):
            drive(relay)
        assert stands(server)
