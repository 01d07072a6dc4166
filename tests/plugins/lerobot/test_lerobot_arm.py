"""LeRobot's arms as controllers: the mapping with a robot of ours, and LeRobot's own drivers on simulated servos."""

from __future__ import annotations

import importlib
import math
import os
import signal
import socket
import subprocess
import threading
import time
from collections import deque
from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any

import numpy as np
import pytest

from kendama_cli.devices.robot.interface import JointCommand
from kendama_cli.devices.robot.open_robot import open_robot
from kendama_cli.devices.robot.udp.remote import UdpRobot
from kendama_cli.errors import HardwareError
from kendama_cli.plugins.suites.robot import CHECKS, check_feedforward, check_time
from kendama_cli.schema.settings import build
from kendama_cli.settings.game import GameSettings
from kendama_cli.settings.hardware import CommandHardware
from kendama_cli.settings.robot import RobotSettings
from tests.devices.robot.stand_in import LOOPBACK, SECRET, key_file
from tests.shipped_conf import configured, plain

pytestmark = pytest.mark.realtime

EXAMPLES = Path(__file__).resolve().parents[3] / "examples" / "controller"
SO101 = Path(__file__).resolve().parents[4] / "shared/data/menagerie/robotstudio_so101/so101.xml"
PERIOD_S = 0.02


@pytest.fixture
def lerobot_arm(monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    """The example, without lerobot."""
    monkeypatch.syspath_prepend(str(EXAMPLES))
    return importlib.import_module("lerobot_arm")


class FakeRobot:
    """Two joints of LeRobot's, at once where they are sent: ``a`` in degrees, ``b`` from -100 to 100."""

    action_features = observation_features = dict.fromkeys(("a.pos", "b.pos", "gripper.pos"), float)
    is_calibrated, is_connected = True, False

    def __init__(self) -> None:
        self.at = {"a.pos": 100.0, "b.pos": 0.0, "gripper.pos": 30.0}
        self.sent: list[dict[str, float]] = []
        self.asked_to_calibrate: bool | None = None
        self.fault: Exception | None = None

    def connect(self, calibrate: bool = True) -> None:
        self.asked_to_calibrate, self.is_connected = calibrate, True

    def disconnect(self) -> None:
        self.is_connected = False

    def get_observation(self) -> dict[str, float]:
        if self.fault:
            raise self.fault
        return dict(self.at)

    def send_action(self, action: dict[str, float]) -> dict[str, float] | None:
        self.sent.append(action)
        self.at = {**action, "a.pos": min(action["a.pos"], 120.0)}  # it clips, and says so
        return dict(self.at)


def two_joints(lerobot_arm: ModuleType) -> Any:
    """Settings of the robot above; a turns against the description, with its zero at 90 degrees."""
    limits = (-3.0, 3.0, 2.0, 20.0, 5.0)
    joints = [
        lerobot_arm.Joint("a", "a.pos", "deg", limits, rest=0.5, zero=90.0, sign=-1),
        lerobot_arm.Joint("b", "b.pos", "0.02", limits, rest=-0.4),
    ]
    return lerobot_arm.Arm("", {}, joints, PERIOD_S, hold={"gripper.pos": 5.0}, approach_rad_s=2.0)


def test_angles_are_lerobots_values_by_sign_unit_and_zero_of_each_joint(lerobot_arm: ModuleType) -> None:
    robot = FakeRobot()
    arm = lerobot_arm.LeRobotArm(robot, two_joints(lerobot_arm))
    arm.connect()
    assert arm.at_rad == pytest.approx([-math.radians(10), 0.0])
    assert robot.sent == [{"a.pos": pytest.approx(100.0), "b.pos": 0.0, "gripper.pos": 5.0}]  # holds where it is
    arm.send((0.1, 0.5))
    assert robot.sent[-1] == {"a.pos": pytest.approx(90 - math.degrees(0.1)), "b.pos": 25.0, "gripper.pos": 5.0}
    assert tuple(arm.sent_rad) == (0.1, 0.5)  # as commanded, to the last bit
    arm.send((-1.0, 7.0))
    assert arm.sent_rad == pytest.approx([-math.radians(30), 3.0])  # what LeRobot clipped, and what the limit of b is


def test_an_arm_is_connected_without_a_question_and_refused_where_it_is_not_calibrated(
    lerobot_arm: ModuleType,
) -> None:
    robot = FakeRobot()
    robot.is_calibrated = False
    with pytest.raises(SystemExit, match="run lerobot-calibrate first"):
        lerobot_arm.LeRobotArm(robot, two_joints(lerobot_arm)).connect()
    assert (robot.asked_to_calibrate, robot.is_connected, robot.sent) == (False, False, [])


def test_what_the_yaml_lacks_or_the_robot_has_not_is_told(lerobot_arm: ModuleType) -> None:
    about, robot = two_joints(lerobot_arm), FakeRobot()
    about.hold.clear()
    with pytest.raises(SystemExit, match=r"under 'hold' .*\['gripper.pos'\]"):
        lerobot_arm.LeRobotArm(robot, about)
    robot.action_features = {"a.pos": float}
    with pytest.raises(SystemExit, match=r"does not take and tell \['b.pos'\]"):
        lerobot_arm.LeRobotArm(robot, about)


def test_an_arm_goes_to_rest_before_it_is_let_go(lerobot_arm: ModuleType) -> None:
    robot = FakeRobot()
    arm = lerobot_arm.LeRobotArm(robot, two_joints(lerobot_arm))
    arm.connect()
    arm.send((0.0, 0.1), (0.0, 4.0))  # in a swing, faster than it approaches
    arm.let_go()
    assert robot.sent[-1]["b.pos"] == pytest.approx(-20.0)
    steps_rad = np.diff([0.02 * one["b.pos"] for one in robot.sent[1:]])
    assert steps_rad[:5] == pytest.approx(np.array([3.6, 3.2, 2.8, 2.4, 2.0]) * PERIOD_S)  # 20 rad/s^2
    assert np.abs(steps_rad[5:]).max() <= 2.0 * PERIOD_S + 1e-9
    assert not robot.is_connected


@pytest.fixture
def served(lerobot_arm: ModuleType) -> Iterator[tuple[FakeRobot, UdpRobot]]:
    """The robot above behind the line."""
    robot, library = FakeRobot(), importlib.import_module("kendama_robot")
    arm = lerobot_arm.LeRobotArm(robot, two_joints(lerobot_arm))
    arm.connect()
    port, limits = free_port(), tuple(map(tuple, arm.limits.tolist()))
    line = library.Robot(port, SECRET, library.Description(("a", "b"), limits, PERIOD_S, 2.0))
    threading.Thread(target=lerobot_arm.serve, args=(arm, line), daemon=True).start()
    with closing(UdpRobot(LOOPBACK, port, SECRET, silence_s=5.0)) as remote:
        yield robot, remote


def command(position: float, velocity: float) -> JointCommand:
    return JointCommand(np.full(2, position), np.full(2, velocity), np.zeros(2))


def test_whatever_lerobot_raises_is_a_stop_in_which_the_arm_slows_down_and_holds(
    served: tuple[FakeRobot, UdpRobot],
) -> None:
    robot, remote = served
    assert remote.reset(np.full(2, 0.2), 0).state.position_rad == pytest.approx([0.2, 0.2])
    assert remote.exchange(command(0.22, 1.0)).state.position_rad == pytest.approx([0.22, 0.22])
    robot.fault = KeyError("a packet was lost")
    with pytest.raises(HardwareError, match=r"it stopped: KeyError: 'a packet was lost'"):
        remote.exchange(command(0.24, 1.0))
    time.sleep(10 * PERIOD_S)
    after = [0.02 * one["b.pos"] for one in robot.sent if 0.02 * one["b.pos"] > 0.239]
    assert np.diff(after) / PERIOD_S == pytest.approx([0.6, 0.2, 0.0])  # 20 rad/s^2, and then nothing is sent
    held = len(robot.sent)
    time.sleep(5 * PERIOD_S)
    assert len(robot.sent) == held
    assert robot.is_connected


def test_a_joint_that_is_held_fast_stops_the_arm_where_it_is(served: tuple[FakeRobot, UdpRobot]) -> None:
    robot, remote = served
    remote.reset(np.zeros(2), 0)
    robot.send_action = robot.sent.append  # type: ignore[method-assign] # and returns nothing
    with pytest.raises(HardwareError, match=r"it stopped: RuntimeError: joint 'a' is 0\.600 rad from its command"):
        remote.exchange(command(0.6, 0.0))
    assert robot.sent[-1]["b.pos"] == pytest.approx(0.0)


# LeRobot's own drivers, in an environment of their own


def lerobot_python(*modules: str) -> str:
    """The interpreter of LeRobot's environment; skips the test where it is not there."""
    python = os.environ.get("LEROBOT_PYTHON", "")
    needs = f"set LEROBOT_PYTHON to the python of an environment with {', '.join(modules)}"
    if not python:
        pytest.skip(f"no lerobot here: {needs}")
    done = subprocess.run([python, "-c", f"import {', '.join(modules)}"], capture_output=True, text=True, check=False)
    if done.returncode:
        pytest.skip(f"{done.stderr.splitlines()[-1]}: {needs}")
    return python


def free_port() -> int:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as free:
        free.bind((LOOPBACK, 0))
        return int(free.getsockname()[1])


@contextmanager
def controlled(python: str, text: str, folder: Path, tries: int = 5) -> Iterator[SimpleNamespace]:
    """The example as a process, for the arm of a YAML's text; ``said`` is why it ended before it listened.

    LeRobot asks each servo once while it connects: on a busy machine an answer may be too late, so it is tried again.
    """
    (folder / "arm.yaml").write_text(text)
    port, key = free_port(), key_file(folder)
    words = [python, str(EXAMPLES / "lerobot_arm.py"), str(folder / "arm.yaml"), str(key), str(port)]
    settings = plain("hardware", "command") | {"host": LOOPBACK, "port": port, "key_file": str(key)}
    for _ in range(tries):
        with subprocess.Popen(
            words, stdout=subprocess.PIPE, stderr=subprocess.PIPE, stdin=subprocess.DEVNULL
        ) as process:
            assert process.stdout is not None
            assert process.stderr is not None
            try:
                if any(said == b"listening\n" for said in process.stdout):  # plug-ins print as well
                    made = build(CommandHardware, settings)
                    yield SimpleNamespace(process=process, port=port, settings=made, said="")
                    return
                said = process.stderr.read().decode()
            finally:
                process.kill()
    yield SimpleNamespace(said=said)


def commanded(arm: SimpleNamespace) -> closing[UdpRobot]:
    """The robot behind the line of ``controlled``."""
    assert not arm.said
    return closing(UdpRobot(LOOPBACK, arm.port, SECRET, silence_s=5.0))


@pytest.fixture
def servos(tmp_path: Path) -> Iterator[SimpleNamespace]:
    """A line with an SO-101's servos; the YAML of the example for it."""
    python = lerobot_python("lerobot", "scservo_sdk", "servolab", "mujoco")
    if not SO101.is_file():
        pytest.skip(f"{SO101} is not there")
    words = [python, str(Path(__file__).with_name("feetech_line.py")), str(SO101), str(tmp_path)]
    with subprocess.Popen(words, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        try:
            port = process.stdout.readline().strip()
            text = (EXAMPLES / "so101.yaml").read_text().replace("my_arm", "test")
            text = text.replace("/dev/ttyACM0", f"{port}, calibration_dir: {tmp_path}")
            text += "watchdog_s: 2.0\nmax_tracking_error_rad: 1.5\n"  # on a busy machine the servos pause
            yield SimpleNamespace(python=python, process=process, text=text)
        finally:
            os.kill(process.pid, signal.SIGCONT)
            process.kill()


def follows(robot: UdpRobot, at: np.ndarray) -> float:
    """Return the largest difference [rad] between encoders and a slow wave of 0.2 rad in all joints, and its end."""
    robot.reset(at, 0)
    worst, n = 0.0, round(3.0 / robot.period_s)
    for k in range(1, n + 1):
        phase = 2 * np.pi * k / n
        wave, speed = 0.1 * (1 - math.cos(phase)), 0.1 * math.sin(phase) * 2 * np.pi / 3.0
        told = robot.exchange(JointCommand(at + wave, np.full(len(at), speed), np.zeros(len(at))))
        assert told.sent.position_rad == pytest.approx(at + wave, abs=1e-12)
        worst = max(worst, float(np.abs(told.state.position_rad - told.sent.position_rad).max()))
    return worst


@pytest.mark.slow
@pytest.mark.timeout(900)
def test_an_so101_by_lerobot_and_feetechs_sdk_plays_and_keeps_the_laws(servos: SimpleNamespace, tmp_path: Path) -> None:
    folded = np.array([0.0, -1.2, 1.0, 0.5, 0.0])
    with controlled(servos.python, servos.text, tmp_path) as arm:
        with commanded(arm) as robot:
            assert robot.joint_names == ("shoulder_pan", "shoulder_lift", "elbow_flex", "wrist_flex", "wrist_roll")
            error = follows(robot, folded)
        print(f"tracking error {error:.4f} rad")
        assert 0.01 < error < 0.15  # it lags by some 50 ms: 0.2 rad/s make 10 mrad, sag and friction the rest
        game, pa10 = configured(GameSettings, "game", "kendama"), configured(RobotSettings, "robot", "fr3")
        for check in CHECKS:
            if check not in (check_time, check_feedforward):  # it counts no missed period, and takes no effort
                check(lambda: open_robot(arm.settings, pa10, game))
        arm.process.send_signal(signal.SIGTERM)
        assert arm.process.wait(timeout=60) == 0
        servos.process.kill()
        released = servos.process.stdout.read().splitlines()[-1].split()  # those before are of configuring
    assert released[0] == "released"
    assert [float(q) for q in released[1:6]] == pytest.approx([0.0, -1.74, 1.68, 1.0, 0.0], abs=0.06)


@pytest.mark.slow
def test_an_so101_whose_line_falls_silent_is_a_stop(servos: SimpleNamespace, tmp_path: Path) -> None:
    with controlled(servos.python, servos.text, tmp_path) as arm, commanded(arm) as robot:
        last = robot.reset(np.array([0.0, -1.2, 1.0, 0.5, 0.0]), 0)
        servos.process.send_signal(signal.SIGSTOP)
        hold = JointCommand(last.sent.position_rad, np.zeros(5), np.zeros(5))
        with pytest.raises(HardwareError, match=r"it stopped: ConnectionError: Failed to sync read 'Present_Position'"):
            deque((robot.exchange(hold) for _ in range(20)), maxlen=0)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("spoilt", "says"),
    [
        (("id: test", "id: other"), "is not calibrated as its file says; run lerobot-calibrate first"),
        (("so101_follower", "so9_follower"), "so9_follower"),
        (("port: ", "port: /dev/none, disable_torque_on_disconnect: true} #"), "/dev/none"),
        (("period_s", "period"), "period"),
        (("lerobot.robots.so_follower", "lerobot.robots.none"), "No module named 'lerobot.robots.none'"),
    ],
    ids=["uncalibrated", "type", "port", "key", "module"],
)
def test_an_arm_that_cannot_be_opened_says_why_in_a_line(
    spoilt: tuple[str, str], says: str, servos: SimpleNamespace, tmp_path: Path
) -> None:
    with controlled(servos.python, servos.text.replace(*spoilt), tmp_path, tries=1) as refused:
        assert says in refused.said
        assert "Traceback" not in refused.said


HEX_ARM = """
module: lerobot_robot_hex_arm_sim
robot: {type: hex_arm_sim_follower, id: x, headless: true, cameras: {}, pos_err_limit: 0.3}
period_s: 0.01
hold: {gripper.value: 0.3}
watchdog_s: 2.0
joints:
  - {name: j1, key: joint_1.pos, unit: rad, limits: [-2.6, 2.6, 6.0, 40.0, 6.0], rest: 0.0}
  - {name: j2, key: joint_2.pos, unit: rad, limits: [-1.5, 2.0, 6.0, 40.0, 6.0], rest: -1.4}
  - {name: j3, key: joint_3.pos, unit: rad, limits: [0.05, 3.1, 6.0, 40.0, 6.0], rest: 2.8}
  - {name: j4, key: joint_4.pos, unit: rad, limits: [-1.5, 1.5, 6.0, 40.0, 6.0], rest: 0.0}
  - {name: j5, key: joint_5.pos, unit: rad, limits: [-1.5, 1.5, 6.0, 40.0, 6.0], rest: 0.0}
  - {name: j6, key: joint_6.pos, unit: rad, limits: [-2.9, 2.9, 6.0, 40.0, 6.0], rest: 0.0}
"""


@pytest.mark.slow
def test_an_arm_of_a_plug_in_of_lerobot_plays(tmp_path: Path) -> None:
    python = lerobot_python("lerobot", "lerobot_robot_hex_arm_sim")
    with controlled(python, HEX_ARM, tmp_path) as arm:
        with commanded(arm) as robot:
            error = follows(robot, np.array([0.0, -1.2, 2.5, 0.0, 0.0, 0.0]))
        print(f"tracking error {error:.4f} rad")
        assert 0.0 < error < 0.05
        arm.process.send_signal(signal.SIGTERM)
        assert arm.process.wait(timeout=60) == 0
