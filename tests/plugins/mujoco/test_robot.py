"""An arm in MuJoCo as a robot: placed as its URDF, refused in one line, its rope, ball and sensors true to the laws."""

from __future__ import annotations

import dataclasses
import math
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

mujoco = pytest.importorskip("mujoco", reason="mujoco (the extra 'mujoco') is not installed")

from kendama_cli.devices.robot.interface import JointCommand  # noqa: E402
from kendama_cli.devices.robot.open_robot import open_robot  # noqa: E402
from kendama_cli.errors import ConfigError, HardwareError, InputError, MissingPartError  # noqa: E402
from kendama_cli.plugins.mujoco.arm_joints import RATE_RAD_S  # noqa: E402
from kendama_cli.plugins.mujoco.files import read_lines  # noqa: E402
from kendama_cli.plugins.mujoco.robot import MujocoRobot  # noqa: E402
from kendama_cli.plugins.suites.robot import CHECKS  # noqa: E402
from kendama_cli.robot_model.cup import cup_frame  # noqa: E402
from kendama_cli.robot_model.model import RobotModel  # noqa: E402
from kendama_cli.settings.robot import RobotSettings  # noqa: E402
from tests.plugins.mujoco.arms import GAME, IIWA, hardware, own_iiwa  # noqa: E402
from tests.shipped_conf import configured  # noqa: E402

WEIGHT_N = (GAME.cup.mass_kg + GAME.ball.mass_kg) * GAME.gravity_m_s2


@pytest.fixture(scope="module")
def model(tmp_path_factory: pytest.TempPathFactory) -> str:
    return own_iiwa(tmp_path_factory.mktemp("iiwa"))


def swayed(robot: MujocoRobot, periods: int, size_rad: float = 0.02) -> list[Any]:
    """What the robot tells of a reset and of periods of all joints' sway 5 rad/s fast, from rest."""
    home, ones = np.array(IIWA.home_rad), np.ones(7)
    told = [robot.reset(home, 3)]
    for k in range(1, periods + 1):
        angle = 5.0 * k * robot.period_s
        at, speed = size_rad * (1 - math.cos(angle)) * ones, 5 * size_rad * math.sin(angle) * ones
        told.append(robot.exchange(JointCommand(home + at, speed, 25 * size_rad * math.cos(angle) * ones)))
    return told


def turned(spec: Any) -> None:
    root = spec.worldbody.first_body()
    root.pos, root.quat = [0.3, -0.2, 0.12], [0.1, 0.7, -0.2, 0.4]


@pytest.mark.parametrize("change", [None, turned])
def test_the_cup_is_where_the_urdf_has_it_however_the_model_stands(
    tmp_path: Path, change: Callable[[Any], None] | None
) -> None:
    robot = MujocoRobot(IIWA, GAME, hardware(own_iiwa(tmp_path, *([] if change is None else [change]))))
    assert robot.arm.deviation_m < 1e-6
    exchange = robot.reset(np.array(IIWA.home_rad), 0)
    assert exchange.scene is not None
    pose = RobotModel(IIWA, GAME.cup, GAME.gravity_m_s2).tool_pose(exchange.scene.position_rad)
    assert exchange.scene.cup_m == pytest.approx(pose.position_m, abs=1e-6)
    assert exchange.scene.cup_rotation == pytest.approx(pose.rotation, abs=1e-6)


@pytest.mark.recording
@pytest.mark.parametrize(
    ("name", "urdf", "mjcf", "most_mm"),
    [
        ("iiwa", None, "kuka_iiwa_14/iiwa14.xml", 1e-3),  # by order: a1 to a7, joint1 to joint7
        ("fr3", None, "franka_fr3/fr3.xml", 1e-3),
        ("ur10", "ur10e.urdf", "universal_robots_ur10e/ur10e.xml", 1.2),  # lengths of links rounded in one of both
    ],
)
def test_arms_of_menagerie_are_those_of_their_urdf(
    recordings: Path, name: str, urdf: str | None, mjcf: str, most_mm: float
) -> None:
    settings: RobotSettings = configured(RobotSettings, "robot", name)
    if urdf is not None:
        settings = dataclasses.replace(settings, path=str(recordings / "urdf" / urdf))
    robot = MujocoRobot(settings, GAME, hardware(str(recordings / "menagerie" / mjcf)))
    assert 1e3 * robot.arm.deviation_m < most_mm


def test_the_model_of_another_arm_is_refused_with_the_deviation(model: str) -> None:
    fr3: RobotSettings = configured(RobotSettings, "robot", "fr3")
    with pytest.raises(InputError, match=r"arm\.xml: its cup is up to \d+\.\d mm from that of robot=fr3; allowed: 2"):
        MujocoRobot(fr3, GAME, hardware(model))


def no_actuators(spec: Any) -> None:
    for one in list(spec.actuators):
        spec.delete(one)


def a_motor(spec: Any) -> None:
    spec.actuators[2].biastype = mujoco.mjtBias.mjBIAS_NONE


def two_servos(spec: Any) -> None:
    servo = spec.add_actuator(name="again", trntype=mujoco.mjtTrn.mjTRN_JOINT, target="a3")
    servo.gainprm[0], servo.biastype = 1.0, mujoco.mjtBias.mjBIAS_AFFINE
    servo.biasprm[1] = -1.0


def a_cart(spec: Any) -> None:
    spec.worldbody.first_body().add_joint(name="cart", type=mujoco.mjtJoint.mjJNT_SLIDE, axis=[1, 0, 0])


def other_joints(spec: Any) -> None:
    spec.delete(spec.actuators[6])
    for joint in spec.joints:
        joint.name = f"joint{joint.name}"
    for actuator in spec.actuators:
        actuator.target = f"joint{actuator.target}"


@pytest.mark.parametrize(
    ("change", "line"),
    [
        (no_actuators, "the model has no actuators"),
        (a_motor, "the actuator of joint 'a3' takes no position; give every joint a position servo"),
        (two_servos, "joint 'a3' has 2 actuators; allowed: one position servo"),
        (a_cart, "joint 'cart' makes the model another chain"),
        (other_joints, r"its 6 joints with actuators \(jointa1, .*\) do not match the robot's 7 \(a1, .*\)"),
    ],
)
def test_what_is_no_arm_with_servos_is_refused(tmp_path: Path, change: Callable[[Any], None], line: str) -> None:
    with pytest.raises(InputError, match=line):
        MujocoRobot(IIWA, GAME, hardware(own_iiwa(tmp_path, change)))


def test_a_file_that_is_no_model_is_refused(tmp_path: Path) -> None:
    (tmp_path / "arm.xml").write_text("<mujoco><worldbody><body></mujoco>")
    with pytest.raises(InputError, match=r"arm\.xml: MuJoCo cannot read it: ") as told:
        MujocoRobot(IIWA, GAME, hardware(str(tmp_path / "arm.xml")))
    assert "\n" not in str(told.value)


def test_servos_that_do_not_hold_the_arm_are_told(tmp_path: Path) -> None:
    with pytest.raises(HardwareError, match=r"joint 'a\d' rests .* rad from it; allowed: 0\.2"):
        MujocoRobot(IIWA, GAME, hardware(own_iiwa(tmp_path, kp=200.0)))


def test_settings_without_a_model_or_with_half_steps_are_refused() -> None:
    with pytest.raises(ConfigError, match="'model' is empty"):
        hardware("")
    with pytest.raises(ConfigError, match=r"a multiple of timestep_s, which is 0\.0015"):
        hardware("arm.xml", timestep_s=0.0015)


def test_without_mujoco_it_says_what_to_install(model: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "mujoco", None)
    with pytest.raises(MissingPartError, match=r"pip install '\.\[mujoco\]'"):
        MujocoRobot(IIWA, GAME, hardware(model))


def test_at_rest_the_ball_hangs_and_the_wrist_carries_cup_and_ball(model: str) -> None:
    robot = MujocoRobot(IIWA, GAME, hardware(model))
    state = swayed(robot, 50, 0.0)[-1].state
    weight_n = GAME.ball.mass_kg * GAME.gravity_m_s2
    hanging_m = GAME.rope.length_m + weight_n / GAME.rope.stiffness_n_m
    assert state.ball_in_world_m - state.cup_in_world_m == pytest.approx([0.0, 0.0, -hanging_m], abs=1e-4)
    tool = RobotModel(IIWA, GAME.cup, GAME.gravity_m_s2).tool_pose(state.position_rad)
    tip = tool.rotation @ cup_frame(IIWA.tool.cup_axis).T
    assert tip @ state.wrist_wrench[:3] == pytest.approx([0.0, 0.0, -WEIGHT_N], abs=1e-3)
    lever = tip @ np.array(IIWA.tool.handle_m)
    cup_n = GAME.cup.mass_kg * GAME.gravity_m_s2
    centre = lever + tool.rotation[:, 2] * GAME.cup.depth_m / 2
    moment = np.cross(lever, [0.0, 0.0, -weight_n]) + np.cross(centre, [0.0, 0.0, -cup_n])
    assert tip @ state.wrist_wrench[3:] == pytest.approx(moment, abs=2e-3)


def test_the_ball_swings_with_the_period_of_its_rope(model: str) -> None:
    """Small swings of a point on a string: T = 2 pi sqrt(l / g), where the cup, its handle and the arm stand still."""
    robot = MujocoRobot(IIWA, GAME, hardware(model, drag_scale=0.0))
    swayed(robot, 314)
    home, still = np.array(IIWA.home_rad), np.zeros(7)
    told = [robot.exchange(JointCommand(home, still, still)) for _ in range(1100)][350:]
    apart_m = np.array([one.state.ball_in_world_m - one.state.cup_in_world_m for one in told])
    angle = np.arctan2(apart_m @ np.linalg.svd(apart_m - apart_m.mean(axis=0))[2][0], -apart_m[:, 2])
    angle -= angle.mean()
    rising = np.flatnonzero((angle[:-1] < 0) & (angle[1:] >= 0))
    period_s = float(np.diff(rising).mean()) * robot.period_s
    assert np.abs(angle).max() > 0.01
    assert period_s == pytest.approx(2 * math.pi * math.sqrt(GAME.rope.length_m / GAME.gravity_m_s2), rel=0.01)


def test_plain_commands_lag_behind_by_the_servos_time(model: str) -> None:
    """kv / kp = 0.1 s: a steady motion is followed that much later (tool and links hang from the joints: to 10 %)."""
    robot = MujocoRobot(IIWA, GAME, hardware(model))
    home, speed = np.array(IIWA.home_rad), np.array([0.3, 0, 0, 0, 0, 0, 0])
    robot.reset(home, 0)
    still = np.zeros(7)
    for k in range(1, 251):
        told = robot.exchange(JointCommand(home + 0.004 * k * speed, speed, still))
    assert (told.sent.position_rad - told.state.position_rad)[0] / 0.3 == pytest.approx(0.1, rel=0.1)


def motors(spec: Any) -> None:
    for one in spec.actuators:
        one.gainprm[0], one.biastype, one.biasprm[:3] = 1.0, mujoco.mjtBias.mjBIAS_NONE, [0.0] * 3
        one.gear[0], one.ctrlrange, one.ctrllimited = 2.0, [-90.0, 90.0], True


def test_motors_that_take_torques_become_servos_of_ours(tmp_path: Path) -> None:
    """Critically damped at w = 50 rad/s a steady motion is followed 2 / w late; nothing sags; the torques stay."""
    file = Path(own_iiwa(tmp_path, motors))
    assert not any("servos of ours" in line for line in read_lines(hardware(str(file))))
    file.write_text(file.read_text().replace("<general", "<motor"))
    assert [line.endswith("so position servos of ours turn them") for line in read_lines(hardware(str(file)))] == [True]
    robot, home, still = MujocoRobot(IIWA, GAME, hardware(str(file))), np.array(IIWA.home_rad), np.zeros(7)
    told = robot.reset(home, 0)
    assert told.state.position_rad == pytest.approx(home, abs=1e-3), "but for the ball's weight"
    assert robot.arm.model.actuator_forcerange.tolist() == [[-180.0, 180.0]] * 7
    weight_nm = RobotModel(IIWA, GAME.cup, GAME.gravity_m_s2).rigid_effort_nm(home, still, still)
    assert told.state.effort_nm == pytest.approx(weight_nm, abs=0.5), "the motors carry arm and ball"
    speed = np.array([0.3, 0, 0, 0, 0, 0, 0])
    for k in range(1, 251):
        told = robot.exchange(JointCommand(home + 0.004 * k * speed, speed, still))
    late_s = (told.sent.position_rad - told.state.position_rad)[0] / 0.3
    assert late_s == pytest.approx(2.0 / RATE_RAD_S - 0.002, rel=0.05), "a command is held for a period of 4 ms"


def test_the_same_seed_gives_the_same_noise_and_game(model: str) -> None:
    robot = MujocoRobot(IIWA, GAME, hardware(model, joint_noise_rad=1e-3, ball_noise_m=1e-3))
    first, second = swayed(robot, 100), swayed(robot, 100)
    for name in ("position_rad", "cup_in_world_m", "ball_in_world_m", "effort_nm"):
        assert np.array_equal(*(np.array([getattr(one.state, name) for one in told]) for told in (first, second)))
    assert first[-1].scene is not None
    noise = np.array([one.state.position_rad - one.scene.position_rad for one in first])
    assert noise.std() == pytest.approx(1e-3, rel=0.1)


@pytest.mark.slow
@pytest.mark.parametrize("check", CHECKS, ids=lambda check: check.__name__)
def test_its_process_keeps_the_laws_of_a_robot(model: str, check: Any) -> None:
    check(lambda: open_robot(hardware(model), IIWA, GAME))
