"""A URDF written from a MuJoCo model is the same arm: frames, ranges, masses, friction."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Any

import numpy as np
import pytest

mujoco = pytest.importorskip("mujoco", reason="mujoco (the extra 'mujoco') is not installed")

from kendama_cli.errors import InputError  # noqa: E402
from kendama_cli.plugins.mujoco.files import arm_files, brought_files  # noqa: E402
from kendama_cli.plugins.mujoco.robot import MujocoRobot  # noqa: E402
from kendama_cli.plugins.mujoco.urdf import arm_urdf  # noqa: E402
from kendama_cli.robot_model.composed import link_poses  # noqa: E402
from kendama_cli.robot_model.description import describe_arm  # noqa: E402
from kendama_cli.robot_model.model import RobotModel  # noqa: E402
from kendama_cli.schema.settings import build  # noqa: E402
from kendama_cli.settings.robot import RobotSettings  # noqa: E402
from tests.cli.typed import kendama, refused  # noqa: E402
from tests.plugins.mujoco.arms import GAME, IIWA, hardware, own_iiwa  # noqa: E402
from tests.shipped_conf import plain  # noqa: E402

ARMS = {
    "franka_emika_panda": 7,
    "kinova_gen3": 7,
    "robotstudio_so101": 5,
    "ufactory_xarm7": 7,
    "universal_robots_ur5e": 6,
}


def odd(spec: Any) -> None:
    """A joint beside its body's origin, one drawn at another angle than zero, a base that leans, a narrow command."""
    spec.joints[1].pos = [0.01, -0.02, 0.03]
    spec.joints[3].ref = 0.4
    spec.worldbody.first_body().quat = [0.9, 0.1, 0.3, -0.2]
    spec.actuators[2].ctrllimited, spec.actuators[2].ctrlrange = True, [-1.0, 0.5]


def written(path: str, folder: Path, n: int) -> RobotSettings:
    """The arm of the MJCF as settings of our own, by the URDF that is written of it."""
    file = folder / "written.urdf"
    made = arm_urdf(path, "arm")
    file.write_text(made.text)
    settings: RobotSettings = build(RobotSettings, {**plain("robot", "urdf"), "path": str(file)}, "robot")
    joints = describe_arm(settings).joint_names
    assert len(joints) == n
    tops, rotors = (3.0,) * n, tuple(made.rotor_inertia_kg_m2[one] for one in joints)
    efforts = describe_arm(settings).limits["effort_nm"]
    known = None if min(efforts) > 0 else (50.0,) * n
    return dataclasses.replace(settings, velocity_rad_s=tops, rotor_inertia_kg_m2=rotors, effort_nm=known)


def compare(path: str, robot: RobotSettings) -> None:
    """Hold the links' poses, by our reading of the URDF, and H and weights, by MuJoCo's, against the model."""
    model, again = mujoco.MjModel.from_xml_path(path), mujoco.MjModel.from_xml_path(robot.path)
    found, names = describe_arm(robot), describe_arm(robot).joint_names
    joints = [model.joint(name).id for name in names]
    angles = np.random.default_rng(0).uniform(-1, 1, (20, len(names)))
    poses = link_poses(found.tree, names, angles)
    for one in (model, again):
        one.dof_armature[:] = 0.0
        one.opt.gravity[:] = 0.0, 0.0, -9.81
    for k, row in enumerate(angles):
        dynamics = []
        for one in (model, again):
            data = mujoco.MjData(one)
            data.qpos[:] = 0.0  # joints off the arm are locked there
            for name, angle in zip(names, row, strict=True):
                data.joint(name).qpos = angle
            mujoco.mj_forward(one, data)
            full = np.zeros((one.nv, one.nv))
            mujoco.mj_fullM(one, data, full)
            moves = [int(one.jnt_dofadr[one.joint(name).id]) for name in names]
            dynamics.append((full[np.ix_(moves, moves)], data.qfrc_bias[moves]))
            if one is model:
                for joint in joints:
                    body = int(one.jnt_bodyid[joint])
                    turn, place = (part[k] for part in poses[one.body(body).name])
                    assert place == pytest.approx(data.xanchor[joint], abs=1e-9)
                    assert turn == pytest.approx(data.xmat[body].reshape(3, 3), abs=1e-9)
        for ours, theirs in zip(*dynamics, strict=True):
            assert theirs == pytest.approx(ours, abs=1e-7)


@pytest.mark.parametrize("change", [lambda _: None, odd], ids=["plain", "odd"])
def test_links_and_masses_are_those_of_the_model(tmp_path: Path, change: Any) -> None:
    path = own_iiwa(tmp_path, change)
    robot = written(path, tmp_path, 7)
    compare(path, robot)
    limits = describe_arm(robot).limits
    if change is odd:
        assert (limits["lower_rad"][2], limits["upper_rad"][2]) == (-1.0, 0.5)
    assert limits["effort_nm"] == pytest.approx((320, 320, 176, 176, 110, 40, 40))


@pytest.mark.recording
@pytest.mark.parametrize(("folder", "n"), ARMS.items())
def test_arms_of_menagerie_are_written_as_they_are(recordings: Path, tmp_path: Path, folder: str, n: int) -> None:
    (path,) = arm_files(recordings / "menagerie" / folder)
    robot = written(str(path), tmp_path, n)
    compare(str(path), robot)


def test_the_command_writes_it_and_says_how_to_go_on(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    own_iiwa(tmp_path)
    code, out, err = kendama(capsys, "robot", "urdf", ".", "--speed", "2", "-o", "mine.urdf")
    assert (code, out) == (0, "arm.xml: 7 joints to 'flange': a1, a2, a3, a4, a5, a6, a7\n")
    speeds, rotors = f"[{','.join(['2'] * 7)}]", f"[{','.join(['0.1'] * 7)}]"
    limits = f"'robot.velocity_rad_s={speeds}' 'robot.rotor_inertia_kg_m2={rotors}'"
    assert (
        f"next: kendama robot place -p perform robot=urdf robot.path=mine.urdf {limits} -o conf/robot/mine.yaml" in err
    )
    assert (
        kendama(capsys, "robot", "describe", "robot=urdf", "robot.path=mine.urdf", f"robot.velocity_rad_s={speeds}")[0]
        == 0
    )
    assert "type numbers in rad/s" in refused(capsys, "robot", "urdf", "arm.xml", "--speed", "fast", "-o", "b.urdf")
    assert "2 values for 7 joints" in refused(capsys, "robot", "urdf", "arm.xml", "--speed", "1,2", "-o", "b.urdf")
    own_iiwa(tmp_path, tireless)
    unknown = f"'robot.velocity_rad_s=[{','.join('?' * 7)}]' 'robot.effort_nm=[{','.join('?' * 7)}]' "
    assert unknown in kendama(capsys, "robot", "urdf", "arm.xml", "-o", "b.urdf")[2]
    (tmp_path / "twin.xml").write_text((tmp_path / "arm.xml").read_text())
    assert "has 2 models of arms; name one: arm.xml, twin.xml" in refused(capsys, "robot", "urdf", ".", "-o", "b.urdf")


def test_what_is_no_arm_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "ball.xml"
    file.write_text("<mujoco><worldbody><body><freejoint/><geom size='1'/></body></worldbody></mujoco>")
    with pytest.raises(InputError, match="the model has no joint that turns; name the model of an arm"):
        arm_urdf(str(file), "ball")


@pytest.mark.parametrize(
    ("joint", "told"),
    [
        ("<joint name='rail' type='slide'/>", "joint 'rail' slides, and carries all that turn"),
        ("<freejoint name='base'/>", "joint 'base' floats, and carries all that turn"),
    ],
)
def test_an_arm_on_a_base_that_moves_is_told_by_its_joint(tmp_path: Path, joint: str, told: str) -> None:
    file = tmp_path / "cart.xml"
    shape = "<geom size='.1'/>"
    arm = f"<body><joint type='hinge'/>{shape}</body>"
    file.write_text(f"<mujoco><worldbody><body>{joint}{shape}{arm}</body></worldbody></mujoco>")
    with pytest.raises(InputError, match=f"{told}; allowed: hinges on a fixed base"):
        arm_urdf(str(file), "cart")


def test_of_two_arms_the_first_is_written_into_the_next_command_and_the_other_is_told(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    arm = "<body name='{0}1'><joint name='{0}1'/><geom size='.1'/><body name='{0}2' pos='.5 0 0'>"
    arm += "<joint name='{0}2'/><geom size='.1'/></body></body>"
    bodies = f"<body name='torso'><geom size='.1'/>{arm.format('left')}{arm.format('right')}</body>"
    motors = "".join(
        f"<motor joint='{side}{k}' gear='-50' ctrlrange='-1 1'/>" for side in ("left", "right") for k in (1, 2)
    )
    Path("two.xml").write_text(f"<mujoco><worldbody>{bodies}</worldbody><actuator>{motors}</actuator></mujoco>")
    code, _, err = kendama(capsys, "robot", "urdf", "two.xml", "--speed", "2", "-o", "two.urdf")
    assert code == 0
    assert "set robot.tip_link to one of: left2, right2" in err
    assert "robot.tip_link=left2 'robot.velocity_rad_s=[2,2]' -o" in err  # motors' ranges are limits of effort
    words = ("robot", "describe", "robot=urdf", "robot.path=two.urdf", "robot.tip_link=left2")
    assert kendama(capsys, *words, "robot.velocity_rad_s=[2,2]")[0] == 0
    settings = {**plain("robot", "urdf"), "path": "two.urdf", "tip_link": "left2"}
    assert describe_arm(build(RobotSettings, settings, "robot")).limits["effort_nm"] == pytest.approx((50.0, 50.0))


def test_a_model_by_a_relative_path_brings_the_meshes_of_what_it_includes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = tmp_path / "model" / "parts"
    folder.mkdir(parents=True)
    corners = "".join(f"v {x} {y} {z}\n" for x, y, z in ((0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)))
    (tmp_path / "model" / "link.obj").write_text(corners + "f 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n")
    (folder / "meshes.xml").write_text("<mujocoinclude><asset><mesh file='../link.obj'/></asset></mujocoinclude>")
    body = "<body><joint name='a1'/><geom type='mesh' mesh='link'/></body>"
    (tmp_path / "model" / "arm.xml").write_text(
        f"<mujoco><include file='parts/meshes.xml'/><compiler meshdir=''/><worldbody>{body}</worldbody></mujoco>"
    )
    monkeypatch.chdir(tmp_path)
    assert "a1" in arm_urdf("model/arm.xml", "arm").rotor_inertia_kg_m2
    assert [one.name for one in brought_files(Path("model/arm.xml"))] == ["link.obj", "meshes.xml"]


def test_where_the_model_reaches_less_than_the_urdf_its_range_counts(tmp_path: Path) -> None:
    robot = MujocoRobot(IIWA, GAME, hardware(own_iiwa(tmp_path, narrow)))
    given = RobotModel(IIWA, GAME.cup, GAME.gravity_m_s2).limits
    assert (robot.limits.lower_rad[2], robot.limits.upper_rad[2]) == (-1.6, 1.5)
    assert np.delete(robot.limits.upper_rad, 2) == pytest.approx(np.delete(given.upper_rad, 2), abs=1e-4)


def tireless(spec: Any) -> None:
    for joint in spec.joints:
        joint.actfrclimited = False


def narrow(spec: Any) -> None:
    spec.actuators[2].ctrllimited, spec.actuators[2].ctrlrange = True, [-1.6, 1.5]
