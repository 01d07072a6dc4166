"""Whoever has not the key stops nothing, moves nothing, and learns nothing that works a second time."""

from __future__ import annotations

import random
import socket
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import numpy as np
import pytest

from kendama_cli.devices.robot.udp import protocol
from kendama_cli.devices.robot.udp.protocol import Datagram, Kind
from kendama_cli.devices.robot.udp.remote import UdpRobot
from kendama_cli.devices.robot.udp.seal import Seal
from tests.devices.robot.stand_in import SECRET, ObedientRobot, command, relayed, served
from tests.faults.test_twin_process import as_bytes, session, twin

__all__ = ["twin"]

Address = tuple[str, int]
COMMANDS = protocol.pack_command(command(3.0))
AT_ONCE = 20  # datagrams


class Tap:
    """Hears every datagram of a line, and says whatever it likes to the robot."""

    def __init__(self) -> None:
        self.heard: list[bytes] = []
        self.inject: list[bytes] = []

    def __call__(self, number: int, data: bytes) -> list[bytes]:
        self.heard.append(data)
        said, self.inject = self.inject, []
        return [*said, data]


def heard_session(address: Address) -> list[bytes]:
    """What went to the robot in a whole session that has ended."""
    tap = Tap()
    with relayed(address, there=tap) as relay:
        client = UdpRobot(*relay, SECRET, silence_s=5.0)
        client.reset(np.zeros(len(client.joint_names)), 0)
        for k in range(5):
            values = np.full(len(client.joint_names), 0.001 * k)
            client.exchange(type(command(0.0))(values, 0 * values, 0 * values))
        client.close()
        time.sleep(0.1)
    return tap.heard


@pytest.mark.parametrize("key", [bytes(32), SECRET], ids=["without_key", "with_key_but_no_session"])
def test_a_foreign_datagram_of_any_kind_is_counted_and_stops_nothing(key: bytes) -> None:
    robot = ObedientRobot()
    with served(robot) as (server, address), socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as foreign:
        client = UdpRobot(*address, SECRET, silence_s=1.0)
        client.reset(np.zeros(2), 0)
        for done, kind in enumerate(Kind):
            number, counter = client._line._number, client._line._counter
            before = server.ignored
            for ahead in range(3):
                foreign.sendto(Seal(key).pack(Datagram(kind, number, counter + ahead, COMMANDS)), address)
            assert client.exchange(command(0.1)).state.position_rad[0] == 0.1
            assert server.stopped is None
            challenged = kind is Kind.HELLO and key == SECRET  # which gives nothing away
            assert server.ignored == before + (0 if challenged else 3), kind.name
            assert client.ignored == server.ignored
            assert len(robot.carried_out) == done + 1
        client.close()


def test_a_session_that_was_heard_cannot_be_played_again() -> None:
    robot = ObedientRobot()
    with served(robot) as (server, address), socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as thief:
        heard = heard_session(address)
        assert len(heard) >= 8
        done, opened = len(robot.carried_out), server._commanded.session.number
        for data in heard * 3:
            thief.sendto(data, address)
        time.sleep(0.2)
        assert (len(robot.carried_out), server._commanded.session.number) == (done, opened)


@pytest.mark.parametrize("realtime", [False, True])
def test_who_sends_every_datagram_on_before_it_arrives_keeps_no_commander_from_its_robot(realtime: bool) -> None:
    robot = ObedientRobot()
    with (
        served(robot, realtime=realtime) as (server, address),
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as line,
    ):

        def sooner(_: int, data: bytes) -> list[bytes]:
            line.sendto(data, address)
            time.sleep(0.002)
            return [data]

        with relayed(address, there=sooner) as relay:
            client = UdpRobot(*relay, SECRET, silence_s=3.0)
            client.reset(np.zeros(2), 0)
            for k in range(20):
                assert client.exchange(command(1e-3 * k)).state.position_rad[0] == 1e-3 * k
            assert server.stopped is None
            client.close()


def test_a_robot_that_was_started_anew_takes_no_replay_either() -> None:
    with served(ObedientRobot()) as (_, address):
        heard = heard_session(address)
    robot = ObedientRobot()
    with (
        served(robot, port=address[1]) as (server, _),
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as thief,
    ):
        for data in heard * 3:
            thief.sendto(data, address)
        time.sleep(0.2)
        assert server.stopped == "no session has begun"
    assert not robot.resets


def test_greetings_build_no_robot_and_challenge_only_who_has_the_key() -> None:
    built: list[ObedientRobot] = []

    class Counted(ObedientRobot):
        def __init__(self) -> None:
            super().__init__()
            built.append(self)

    with served(Counted()) as (_, address), socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as line:
        line.settimeout(0.2)
        for key, answers in ((bytes(32), 0), (SECRET, 100)):
            for _ in range(100):
                line.sendto(Seal(key).pack(Datagram(Kind.HELLO, 0, 0, bytes(16))), address)
            heard = 0
            while True:
                try:
                    assert Seal(SECRET).unpack(line.recv(4096)).kind is Kind.CHALLENGE
                except TimeoutError:
                    break
                heard += 1
            assert heard == answers
    assert len(built) == 1


def test_who_replays_keeps_no_dead_commanders_robot_moving() -> None:
    """The watchdog of a robot in real time counts from the last new datagram, whatever else comes."""
    robot, tap = ObedientRobot(), Tap()
    with served(robot, realtime=True, watchdog_s=0.3) as (server, address), relayed(address, there=tap) as relay:
        client = UdpRobot(*relay, SECRET, silence_s=5.0)
        client.reset(np.zeros(2), 0)
        for k in range(5):
            client.exchange(command(0.01 * k))
        until = time.monotonic() + 3.0
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as thief:
            while server.stopped is None and time.monotonic() < until:
                for data in tap.heard[-5:]:
                    thief.sendto(data, address)
                time.sleep(0.001)
        assert server.stopped == "no datagram came for 0.3 s while moving"
        client.close()


def mutated(data: bytes, rng: random.Random) -> bytes:
    """``data`` with one to four of its bits flipped, cut short, or longer."""
    made = bytearray(data)
    how = rng.randrange(4)
    if how == 0:
        return bytes(made[: rng.randrange(len(made))])
    if how == 1:
        return bytes(made) + rng.randbytes(rng.randrange(1, 60))
    for bit in rng.sample(range(8 * len(made)), rng.randrange(1, 5)):
        made[bit // 8] ^= 1 << bit % 8
    return bytes(made)


@contextmanager
def attacked(address: Address, tap: Tap, old: list[bytes], count: int) -> Iterator[Callable[[], int]]:
    """``count`` datagrams to ``address`` from a thread: of every sort; yields how many are left."""
    left, over = count, threading.Event()
    foreign = Seal(bytes(32))

    def attack() -> None:
        nonlocal left
        rng = random.Random(7)
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as line:
            while left > 0 and not over.is_set():
                known = tap.heard[-1] if tap.heard and rng.random() < 0.5 else rng.choice(old)
                how = rng.randrange(4)
                if how == 0:
                    data = rng.randbytes(rng.randrange(200))
                elif how == 1:
                    data = foreign.pack(
                        Datagram(rng.choice(list(Kind)), rng.getrandbits(63), rng.randrange(9), bytes(64))
                    )
                else:
                    data = known if how == 2 else mutated(known, rng)
                if len(tap.inject) < 4:
                    tap.inject.append(data)  # from the commander's own address
                line.sendto(data, address)
                left -= 1
                if left % AT_ONCE == 0:
                    time.sleep(0.001)  # the robot and the commander are threads of this process: they need their turn

    thread = threading.Thread(target=attack)
    thread.start()
    try:
        yield lambda: left
    finally:
        over.set()
        thread.join()


def test_thirty_thousand_datagrams_change_nothing_of_what_a_robot_does() -> None:
    robot, tap = ObedientRobot(), Tap()
    with served(robot) as (server, address):
        old = heard_session(address)
        before = len(robot.carried_out)
        with relayed(address, there=tap) as relay, attacked(address, tap, old, 30_000) as left:
            client = UdpRobot(*relay, SECRET, silence_s=30.0)
            client.reset(np.zeros(2), 0)
            k = 0
            while left() > 0:
                assert client.exchange(command(1e-4 * k)).state.position_rad[0] == 1e-4 * k
                k += 1
            assert server.stopped is None
            client.close()
        assert server.ignored > 0
    assert [float(one.position_rad[0]) for one in robot.carried_out[before:]] == [1e-4 * i for i in range(k)]


@pytest.mark.slow
def test_a_flood_changes_no_byte_of_what_the_twin_does(twin: tuple[object, Address]) -> None:
    address = twin[1]
    old = heard_session(address)
    first = UdpRobot(*address, SECRET, silence_s=10.0)
    quiet = as_bytes(session(first, 5))
    first.close()
    tap = Tap()
    with relayed(address, there=tap) as relay, attacked(address, tap, old, 400_000) as left:
        client = UdpRobot(*relay, SECRET, silence_s=10.0)
        while left() > 0:
            assert as_bytes(session(client, 5)) == quiet
        assert client.ignored > 0
        client.close()
