"""The robot's end of the line as laboratories get it, in Python and in C++, each as a controller of its own."""

from __future__ import annotations

import ast
import os
import shutil
import socket
import struct
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import closing
from hashlib import blake2s
from pathlib import Path

import numpy as np
import pytest

from kendama_cli.artifacts.motion_plan import JointTrajectory
from kendama_cli.devices.robot.interface import JointCommand
from kendama_cli.devices.robot.open_robot import open_robot
from kendama_cli.devices.robot.udp.protocol import Datagram, Kind
from kendama_cli.devices.robot.udp.remote import LimitedRobot, UdpRobot
from kendama_cli.devices.robot.udp.seal import Seal
from kendama_cli.errors import HardwareError
from kendama_cli.motion import minimum_jerk
from kendama_cli.plugins.suites.robot import CHECKS, check_time
from kendama_cli.schema.settings import build
from kendama_cli.settings.game import GameSettings
from kendama_cli.settings.hardware import CommandHardware
from kendama_cli.settings.robot import RobotSettings
from tests.devices.robot.stand_in import LOOPBACK, SECRET, key_file, relayed
from tests.shipped_conf import configured, plain

pytestmark = pytest.mark.realtime

FOLDER = Path(__file__).resolve().parents[3] / "examples" / "controller"
NAMES = ("s1", "s2", "s3", "e1", "e2", "w1", "w2")
GAME, ARM = configured(GameSettings, "game", "kendama"), configured(RobotSettings, "robot", "fr3")
WATCHDOG_S = 2.0
"""A busy machine stalls a process for longer than the 0.25 s that are told to laboratories."""
Address = tuple[str, int]


@pytest.fixture(scope="module")
def built(tmp_path_factory: pytest.TempPathFactory) -> Path | None:
    """The folder with what g++ made; None where there is no compiler."""
    if shutil.which("g++") is None:
        return None
    folder = tmp_path_factory.mktemp("built")
    (folder / "hash.cpp").write_text(
        '#include <cstdio>\n#include "blake2s.hpp"\nint main() {\n'
        "  for (int size : {16, 32}) for (int n = 0; n < 260; ++n) {\n"
        "    kendama::Bytes key(32), data(n);\n"
        "    for (int i = 0; i < 32; ++i) key[i] = i;\n    for (int i = 0; i < n; ++i) data[i] = i * 7;\n"
        '    for (int b : kendama::blake2s(key, data, size)) std::printf("%02x", b);\n    std::puts("");\n  }\n}\n'
    )
    for source in (FOLDER / "stand_in.cpp", folder / "hash.cpp"):
        flags = ["-std=c++17", "-O1", "-Wall", "-Wextra", "-Werror", f"-I{FOLDER}"]
        subprocess.run(["g++", *flags, str(source), "-o", str(folder / source.stem)], check=True)
    return folder


@pytest.fixture(params=["python", "c++"])
def controller(
    request: pytest.FixtureRequest, tmp_path: Path, built: Path | None
) -> Iterator[tuple[subprocess.Popen[bytes], Address]]:
    """A stand-in controller that listens."""
    if request.param == "c++" and built is None:
        pytest.skip("no g++ here; .ci/run installs it")
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as free:
        free.bind((LOOPBACK, 0))
        address: Address = free.getsockname()
    made = [str((built or FOLDER) / "stand_in")]
    program = made if request.param == "c++" else [sys.executable, str(FOLDER / "stand_in.py")]
    words = [str(key_file(tmp_path)), str(address[1]), str(WATCHDOG_S)]
    process = subprocess.Popen([*program, *words], stdout=subprocess.PIPE)
    assert process.stdout is not None
    assert process.stdout.readline() == b"listening\n"
    yield process, address
    process.kill()
    process.wait()
    process.stdout.close()


def swing(period_s: float) -> JointTrajectory:
    """A second of minimum jerk there, and one back."""
    t_s = period_s * np.arange(round(2.0 / period_s) + 1)
    s = np.asarray(minimum_jerk.step(np.minimum(t_s, 2.0 - t_s)))
    reach = np.linspace(0.1, 0.3, 7)
    position = 0.2 + s[:, None] * reach
    velocity = np.gradient(position, t_s, axis=0)
    return JointTrajectory(NAMES, t_s, position, velocity, np.gradient(velocity, t_s, axis=0))


def test_a_controller_plays_a_motion_that_is_commanded(controller: tuple[object, Address]) -> None:
    with closing(UdpRobot(*controller[1], SECRET, silence_s=5.0)) as robot:
        assert (robot.joint_names, robot.period_s, robot.realtime) == (NAMES, 0.004, True)
        assert np.array_equal(robot.limits.velocity_rad_s, np.full(7, 2.0))
        motion = swing(robot.period_s)
        played = [robot.reset(motion.position_rad[0], 1)]  # from where it is not: it goes there first, slowly
        rows = zip(motion.position_rad[1:], motion.velocity_rad_s[1:], motion.acceleration_rad_s2[1:], strict=True)
        played += [robot.exchange(JointCommand(*row)) for row in rows]
        reached = np.array([one.state.position_rad for one in played])
        assert np.abs(reached[0] - motion.position_rad[0]).max() == 0.0
        assert np.abs(reached - motion.position_rad).max() < 1e-12
        assert played[-1].t_s >= motion.t_s[-1] - 1e-9
        assert robot.missed < 0.5 * len(motion.t_s)


def test_a_controller_that_limits_nothing_keeps_the_laws_of_a_robot_for_we_limit_what_goes_to_it(
    controller: tuple[object, Address], tmp_path: Path
) -> None:
    host, port = controller[1]
    settings = build(
        CommandHardware,
        plain("hardware", "command") | {"host": host, "port": port, "key_file": str(key_file(tmp_path))},
    )
    for check in CHECKS:
        if check is not check_time:  # it counts no period in which a command was late: it has none to compare with
            check(lambda: open_robot(settings, ARM, GAME))


def test_an_arm_that_is_sent_beyond_its_limits_does_not_go_there(controller: tuple[object, Address]) -> None:
    with closing(LimitedRobot(*controller[1], SECRET, silence_s=5.0)) as robot:
        with pytest.raises(HardwareError, match=r"the arm is to go to \[4\.0, .* it says that it reaches \[-3\.0, "):
            robot.reset(np.full(7, 4.0), 0)
        with pytest.raises(HardwareError, match="in a latched stop"):
            robot.reset(np.zeros(7), 0)


def test_a_controller_ignores_who_has_not_the_key(controller: tuple[object, Address]) -> None:
    address = controller[1]
    with pytest.raises(HardwareError, match=r"no answer to HELLO within 0\.2 s; has it the same key"):
        UdpRobot(*address, bytes(32), silence_s=0.2)
    with (
        closing(UdpRobot(*address, SECRET, silence_s=5.0)) as robot,
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as foreign,
    ):
        before = robot.reset(np.zeros(7), 0)
        rng = np.random.default_rng(3)
        number, counter = robot._line._number, robot._line._counter
        for k in range(500):
            kind = list(Kind)[k % len(Kind)]
            foreign.sendto(Seal(bytes(32)).pack(Datagram(kind, number, counter + k % 3, bytes(224))), address)
            foreign.sendto(rng.bytes(k % 90), address)
            time.sleep(0.001)  # none is lost to the system's buffer: each is counted
        with pytest.raises(HardwareError, match="another commander has it"):
            UdpRobot(*address, SECRET, silence_s=5.0)
        after = robot.exchange(JointCommand(np.zeros(7), np.zeros(7), np.zeros(7)))
        assert np.array_equal(after.state.position_rad, before.state.position_rad)
        assert robot.ignored >= 1000


def test_who_sends_every_datagram_on_sooner_keeps_no_commander_from_its_controller(
    controller: tuple[object, Address],
) -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as thief:

        def sooner(_: int, data: bytes) -> list[bytes]:
            thief.sendto(data, controller[1])
            time.sleep(0.0005)
            return [data]

        with relayed(controller[1], there=sooner) as relay, closing(UdpRobot(*relay, SECRET, silence_s=5.0)) as robot:
            robot.reset(np.zeros(7), 0)
            for k in range(20):
                state = robot.exchange(JointCommand(np.full(7, 1e-4 * k), np.zeros(7), np.zeros(7))).state
            assert state.position_rad[0] > 0


def test_a_controller_stops_for_good_when_its_commander_falls_silent(controller: tuple[object, Address]) -> None:
    with closing(UdpRobot(*controller[1], SECRET, silence_s=5.0)) as robot:
        robot.reset(np.zeros(7), 0)
        robot.exchange(JointCommand(np.full(7, 0.004), np.zeros(7), np.zeros(7)))
        time.sleep(1.5 * WATCHDOG_S)
        with pytest.raises(HardwareError, match=r"it stopped: no datagram came .* while moving"):
            robot.exchange(JointCommand(np.full(7, 0.008), np.zeros(7), np.zeros(7)))
    with closing(UdpRobot(*controller[1], SECRET, silence_s=5.0)) as again:
        assert np.array_equal(again.reset(np.zeros(7), 0).state.position_rad, np.zeros(7))


@pytest.mark.parametrize(
    ("values", "says"),
    [(np.full(7, np.nan), "not finite"), (np.zeros(6), "not whole")],
    ids=["not_finite", "six_of_seven"],
)
def test_a_controller_stops_for_a_command_that_makes_no_sense(
    controller: tuple[object, Address], values: np.ndarray, says: str
) -> None:
    with closing(UdpRobot(*controller[1], SECRET, silence_s=5.0)) as robot:
        robot.reset(np.zeros(7), 0)
        with pytest.raises(HardwareError, match=f"it stopped: .*{says}"):
            robot.exchange(JointCommand(values, values, values))


class ByHand:
    """A commander that says what it should not: an authentic line of its own."""

    def __init__(self, address: Address) -> None:
        self.line = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.line.connect(address)
        self.line.settimeout(20)
        nonce = bytes(range(16))
        self.key, self.number = SECRET, 0
        robot = self.ask(1, 0, nonce)[1][16:]
        self.number = int.from_bytes(robot[:8], "little")
        self.key = blake2s(b"kendama session" + nonce + robot, key=SECRET, digest_size=32).digest()
        self.ask(3, 1, nonce)

    def say(self, kind: int, counter: int, payload: bytes = b"") -> None:
        bare = struct.pack("<4sHHQQ", b"KNDM", 5, kind, self.number, counter) + payload
        self.line.send(bare + blake2s(bare, key=self.key, digest_size=16).digest())

    def ask(self, kind: int, counter: int, payload: bytes = b"") -> tuple[int, bytes]:
        """Kind and payload of the answer to it."""
        self.say(kind, counter, payload)
        while True:
            data = self.line.recv(9000)
            answered, _, of = struct.unpack_from("<HQQ", data, 6)
            if of == counter and answered != 12:
                return answered, data[24:-16]


def reset_to(value: float) -> bytes:
    return struct.pack("<Q7d", 0, *[value] * 7)


COMMANDED = struct.pack("<28d", *[2.0] * 7, *[0.0] * 21)


@pytest.mark.parametrize("kind", [6, 8], ids=["command", "halt"])
def test_a_controller_obeys_nothing_before_it_has_answered_a_reset(
    controller: tuple[object, Address], kind: int
) -> None:
    commander = ByHand(controller[1])
    with closing(commander.line):
        commander.say(5, 2, reset_to(2.0))  # takes two seconds
        time.sleep(0.1)
        answered, why = commander.ask(kind, 3, COMMANDED if kind == 6 else b"")
        assert answered == 9
        assert (b"before RESET was answered" in why) == (kind == 6)
        assert commander.ask(5, 4, reset_to(2.0))[0] == 9  # and so it stays


def test_a_controller_takes_the_newest_of_two_resets(controller: tuple[object, Address]) -> None:
    commander = ByHand(controller[1])
    with closing(commander.line):
        commander.say(5, 2, reset_to(2.0))
        time.sleep(0.1)
        answered, state = commander.ask(5, 3, reset_to(0.0))
        assert answered == 7
        assert struct.unpack_from("<7d", state, 17 + 28 * 8) == (0.0,) * 7
        assert commander.ask(6, 4, struct.pack("<28d", *[0.0] * 28))[0] == 7


def test_the_count_of_missed_periods_begins_anew_after_32_bits(controller: tuple[object, Address]) -> None:
    commander = ByHand(controller[1])
    with closing(commander.line):
        answered, state = commander.ask(5, 1 << 40, reset_to(0.0))
        assert (answered, struct.unpack_from("<dI", state)[1]) == (7, ((1 << 40) - 2) % (1 << 32))
        answered, state = commander.ask(6, (1 << 41) + 7, struct.pack("<28d", *[0.0] * 28))
        assert answered == 7


STOPS = """
import sys, time
sys.path.insert(0, sys.argv[3])
from kendama_robot import Description, Heard, Robot, State, read_key, Command
one = (1.0,)
line = Robot(int(sys.argv[2]), read_key(sys.argv[1]), Description(("a",), ((-1.0,), one, one, one, one), 0.004, 1.0))
print("listening", flush=True)
while True:
    heard = line.poll(0.004)
    if heard is Heard.RESET:
        time.sleep(0.2)
        line.stop("its emergency stop was pressed")
        line.answer(State(0.0, Command((0.0,)), (0.0,), (0.0,), (0.0,)))
"""
STOPS_CPP = """
#include <iostream>
#include <thread>
#include "kendama_robot.hpp"
int main(int, char** words) {
  kendama::Joints one{1.0};
  kendama::Robot line(uint16_t(std::stoi(words[2])), kendama::read_key(words[1]),
                      {{"a"}, {-1.0}, one, one, one, one, 0.004, 1.0});
  std::cout << "listening" << std::endl;
  while (true)
    if (line.poll(0.004) == kendama::Heard::reset) {
      std::this_thread::sleep_for(std::chrono::milliseconds(200));
      line.stop("its emergency stop was pressed");
      line.answer({0.0, {}, {0.0}, {0.0}, {0.0}});
    }
}
"""


@pytest.mark.parametrize("language", ["python", "c++"])
def test_a_stop_during_a_reset_answers_it(language: str, tmp_path: Path) -> None:
    if language == "c++" and shutil.which("g++") is None:
        pytest.skip("no g++ here; .ci/run installs it")
    (tmp_path / "stops.py").write_text(STOPS)
    (tmp_path / "stops.cpp").write_text(STOPS_CPP)
    program = [sys.executable, str(tmp_path / "stops.py")]
    if language == "c++":
        program = [str(tmp_path / "stops")]
        flags = ["-std=c++17", "-Wall", "-Wextra", "-Werror", f"-I{FOLDER}"]
        subprocess.run(["g++", *flags, str(tmp_path / "stops.cpp"), "-o", program[0]], check=True)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as free:
        free.bind((LOOPBACK, 0))
        address: Address = free.getsockname()
    words = [str(key_file(tmp_path)), str(address[1]), str(FOLDER)]
    with subprocess.Popen([*program, *words], stdout=subprocess.PIPE) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == b"listening\n"
        try:
            robot = UdpRobot(*address, SECRET, silence_s=5.0)
            with closing(robot), pytest.raises(HardwareError, match="it stopped: its emergency stop was pressed"):
                robot.reset(np.zeros(1), 0)
        finally:
            process.kill()


def test_a_controller_that_dies_is_one_clear_error(
    controller: tuple[subprocess.Popen[bytes], Address],
) -> None:
    with closing(UdpRobot(*controller[1], SECRET, silence_s=5.0)) as robot:
        robot.reset(np.zeros(7), 0)
        controller[0].kill()
        controller[0].wait()
        with pytest.raises(HardwareError, match="nothing listens there; it is in a latched stop"):
            robot.exchange(JointCommand(np.zeros(7), np.zeros(7), np.zeros(7)))


def test_the_hash_in_c_plus_plus_is_blake2s(built: Path | None) -> None:
    if built is None:
        pytest.skip("no g++ here; .ci/run installs it")
    said = subprocess.run([str(built / "hash")], capture_output=True, text=True, check=True).stdout.split()
    data = bytes(i * 7 % 256 for i in range(260))
    assert said == [
        blake2s(data[:n], key=SECRET, digest_size=size).hexdigest() for size in (16, 32) for n in range(260)
    ]


def test_each_library_is_one_short_file_that_needs_nothing() -> None:
    for name in ("kendama_robot.py", "kendama_robot.hpp"):
        assert len((FOLDER / name).read_text().splitlines()) < 200, name
    tree = ast.parse((FOLDER / "kendama_robot.py").read_text())
    brought = {node.module or "" for node in ast.walk(tree) if isinstance(node, ast.ImportFrom)}
    brought |= {one.name for node in ast.walk(tree) if isinstance(node, ast.Import) for one in node.names}
    assert {name.partition(".")[0] for name in brought} <= sys.stdlib_module_names
    assert os.path.isfile(FOLDER / "blake2s.hpp")
