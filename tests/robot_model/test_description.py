from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Any

import pytest

from kendama_cli.errors import ConfigError, InputError
from kendama_cli.robot_model.arm_scene import ArmScene
from kendama_cli.robot_model.description import Description, read_description
from kendama_cli.settings.robot import PER_JOINT
from tests.robot_model.inertia import inertia_of
from tests.simulation.dart.bench_robot import bench_arm, kendama_game, modelled

GOOD = Path(bench_arm().path).read_text()
NOT_GIVEN: dict[str, Any] = dict.fromkeys(PER_JOINT)


def read(file: Path, tip_link: str | None = None, base_link: str | None = None, **given: object) -> Description:
    """The description at ``file`` as ``robot=urdf`` reads it."""
    named: dict[str, Any] = {"path": str(file), "tip_link": tip_link, "base_link": base_link, **given}
    return read_description(dataclasses.replace(bench_arm(), **NOT_GIVEN, **named))


def _refusal(tmp_path: Path, text: str, tip_link: str = "flange", base_link: str | None = None) -> InputError:
    file = tmp_path / "robot.urdf"
    file.write_text(text)
    with pytest.raises(InputError) as caught:
        read(file, tip_link, base_link)
    assert str(caught.value).startswith(str(file))
    assert "\n" not in str(caught.value)
    return caught.value


def test_the_shipped_arm_has_seven_joints_with_the_published_speeds() -> None:
    arm = modelled(bench_arm())
    assert arm.joint_names == ("s1", "s2", "s3", "e1", "e2", "w1", "w2")
    degrees = arm.limits.velocity_rad_s * 180 / 3.141592653589793
    assert degrees == pytest.approx([57, 57, 114, 114, 360, 360, 360], rel=1e-5)


def test_a_file_that_is_no_xml_is_refused_with_its_line(tmp_path: Path) -> None:
    assert "line 3: is not well-formed XML" in str(_refusal(tmp_path, "<robot>\n<link name='a'/>\n<link"))


@pytest.mark.parametrize("rubbish", [b"\x00\xff\xfe\x01", b"", b"\x93NUMPY"])
def test_binary_rubbish_is_refused(tmp_path: Path, rubbish: bytes) -> None:
    file = tmp_path / "robot.urdf"
    file.write_bytes(rubbish)
    with pytest.raises(InputError, match=r"robot\.urdf"):
        read(file, "flange")


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('<robot name="pa10">', '<sdf name="pa10">', "not well-formed"),
        ('<child link="link_e1"/>', '<child link="elbow"/>', "joint 'e1': has no link 'elbow' for the child"),
        ('<mass value="3.51"/>', '<mass value="0"/>', "has no mass in the link 'link_s3': no setting can give it"),
        (
            'velocity="0.994838" effort="232"',
            'effort="232"',
            "gives no velocity limit for 1 joint: s1; give it beside the file: robot.velocity_rad_s=[...] with 7",
        ),
        (
            'lower="-2.391101"',
            'lower="3"',
            "has a lower limit that is not below its upper one for 1 joint: e1; give both beside the file",
        ),
        (
            '<joint name="w1" type="revolute">',
            '<joint name="w1" type="planar">',
            "joint 'w1' is planar (a base that drives)",
        ),
        ('<joint name="s2"', '<joint name="s1"', "has 2 joints called 's1'"),
        ('<joint name="s2"', "<joint", "has a joint without a name"),
        ('<link name="link_s2">', '<link name="link_s1">', "has 2 links called 'link_s1'"),
        ('<origin xyz="0 0 0.317"/>', '<origin xyz="a b c"/>', "joint 's1' has <origin xyz='a b c'>; give 3 numbers"),
        ('<origin xyz="0 0 0.317"/>', '<origin rpy="0 0"/>', "joint 's1' has <origin rpy='0 0'>; give 3 numbers"),
        ('<axis xyz="0 0 1"/>', '<axis xyz="0 0 0"/>', "joint 's1' has an axis without direction"),
        ('ixx="0.057050"', 'ixx="many"', "link 'link_s1' has ixx='many'; a moment of inertia is a number"),
        (
            'ixx="0.057050"',
            'ixx="-1"',
            "link 'link_s1' has ixx='-1'; a moment of inertia is a number, and not negative",
        ),
        (
            '<joint name="w2" type="revolute">',
            '<joint name="w2" type="revolute"><mimic joint="w1"/>',
            "joint 'w2' mimics joint 'w1'; allowed on the way to the tip: revolute, continuous, fixed; hold it where "
            "it is: robot.locked_joints=[w2]",
        ),
        (
            '<joint name="s2" type="revolute">',
            '<joint name="s2" type="prismatic">',
            "joint 's2' is prismatic (a rail, lift or slide); allowed on the way to the tip: revolute, continuous, "
            "fixed; hold it where it is: robot.locked_joints=[s2], begin after it: robot.base_link=link_s2",
        ),
        ('<mass value="3.51"/>', '<mass value="-3.51"/>', "link 'link_s3' has the mass '-3.51'"),
        ('<mass value="3.51"/>', '<mass value="nan"/>', "link 'link_s3' has the mass 'nan'"),
        ('<link name="base">', '<link name="base"><xacro:box/>', "is a xacro file"),
        ('<origin xyz="0 0 0.317"/>', '<origin xyz="0 0 ${height}"/>', "is a xacro file"),
        ('<mass value="3.51"/>', "<mass value=3.51/>", "is not well-formed XML (not well-formed"),
        ('<child link="link_s2"/>', '<child link="link_s1"/>', "link 'link_s1': hangs on two joints, s1, s2"),
    ],
)
def test_a_flaw_in_a_urdf_is_named(tmp_path: Path, old: str, new: str, words: str) -> None:
    assert old in GOOD
    assert words in str(_refusal(tmp_path, GOOD.replace(old, new, 1)))


def test_a_file_of_another_kind_is_refused(tmp_path: Path) -> None:
    assert "its root is <html>, not <robot>" in str(_refusal(tmp_path, "<html/>"))


def test_a_tip_that_does_not_exist_is_refused_with_those_that_do(tmp_path: Path) -> None:
    message = str(_refusal(tmp_path, GOOD, "tool0"))
    assert "has no link 'tool0'" in message
    assert "flange" in message


def test_a_xacro_file_is_refused_with_the_command_that_expands_it(tmp_path: Path) -> None:
    text = (
        '<robot name="arm" xmlns:xacro="http://www.ros.org/wiki/xacro"><xacro:include filename="parts.xacro"/></robot>'
    )
    assert "is a xacro file, not a URDF yet; expand it first: xacro robot.urdf > robot_plain.urdf" in str(
        _refusal(tmp_path, text)
    )


def test_a_ring_of_joints_is_refused_wherever_it_is(tmp_path: Path) -> None:
    ring = '<link name="x"/><link name="y"/><joint name="xy" type="fixed"><parent link="x"/><child link="y"/></joint>'
    ring += '<joint name="yx" type="fixed"><parent link="y"/><child link="x"/></joint></robot>'
    assert "has a ring of joints through" in str(_refusal(tmp_path, GOOD.replace("</robot>", ring)))


def test_a_held_joint_must_exist(tmp_path: Path) -> None:
    file = tmp_path / "robot.urdf"
    file.write_text(GOOD)
    with pytest.raises(InputError, match=r"has no joint 'lift'; set robot\.locked_joints to some of: s1, s2"):
        read(file, "flange", locked_joints=("lift",))


def test_a_moving_frame_without_mass_is_fine_where_it_carries_some(tmp_path: Path) -> None:
    """Some makers put a joint's link and its body in two links, the second fixed to the first."""
    file = tmp_path / "robot.urdf"
    inertial = GOOD[GOOD.index('<link name="link_w2">') + len('<link name="link_w2">') :]
    inertial = inertial[: inertial.index("</link>")]
    body = '<link name="body">' + inertial + '</link><joint name="holds" type="fixed"><parent link="link_w2"/>'
    body += '<child link="body"/><axis xyz="0 0 0"/></joint></robot>'
    file.write_text(GOOD.replace(inertial, "", 1).replace("</robot>", body))
    split = modelled(dataclasses.replace(bench_arm(), path=str(file)))
    whole = modelled(bench_arm())
    assert split.new_body().skeleton.getMass() == pytest.approx(whole.new_body().skeleton.getMass(), abs=1e-5)


def test_of_two_arms_the_user_must_choose_one(tmp_path: Path) -> None:
    second = GOOD[GOOD.index('  <joint name="s1"') : GOOD.index("</robot>")]
    for name in ("s1", "s2", "s3", "e1", "e2", "w1", "w2", "flange_mount"):
        second = second.replace(f'"{name}"', f'"left_{name}"').replace(f'"link_{name}"', f'"left_link_{name}"')
    second = second.replace('"flange"', '"left_flange"')
    file = tmp_path / "robot.urdf"
    file.write_text(GOOD.replace("</robot>", second + "</robot>"))
    with pytest.raises(InputError, match=r"has 2 chains of 7 moving joints; set robot\.tip_link to one of: ") as caught:
        read(file)
    assert "left_flange" in str(caught.value)
    assert read(file, "left_flange").joint_names[0] == "left_s1"


def test_a_base_that_does_not_exist_is_refused_with_those_that_do(tmp_path: Path) -> None:
    message = str(_refusal(tmp_path, GOOD, base_link="pelvis"))
    assert "has no link 'pelvis'; set robot.base_link to one of: base, flange" in message


def test_a_tip_that_is_not_beyond_the_base_is_refused(tmp_path: Path) -> None:
    message = str(_refusal(tmp_path, GOOD, tip_link="link_s2", base_link="link_e1"))
    assert "has no link 'link_s2' beyond 'link_e1'; set robot.tip_link to one of: flange, link_e1" in message


def test_a_chain_may_start_anywhere(tmp_path: Path) -> None:
    """What is before the base link is left out, and the base pose is that link's."""
    arm = modelled(dataclasses.replace(bench_arm(), base_link="link_s3", **NOT_GIVEN))
    assert arm.joint_names == ("e1", "e2", "w1", "w2")
    pose = arm.new_body().skeleton.getBodyNode("link_s3").getWorldTransform().translation()
    assert pose == pytest.approx(bench_arm().base_position_m)


def test_a_urdf_without_links_is_refused(tmp_path: Path) -> None:
    assert "has no links" in str(_refusal(tmp_path, '<robot name="nothing"/>'))


def test_a_tip_that_nothing_moves_is_refused(tmp_path: Path) -> None:
    assert "has no moving joint on the way to 'base'" in str(_refusal(tmp_path, GOOD, "base"))


def test_joints_off_the_chain_are_held_fixed(tmp_path: Path) -> None:
    finger = (
        '<joint name="finger" type="prismatic"><parent link="flange"/><child link="tip"/></joint>'
        '<link name="tip"><inertial><mass value="0.1"/>'
        '<inertia ixx="1e-5" ixy="0" ixz="0" iyy="1e-5" iyz="0" izz="1e-5"/></inertial></link></robot>'
    )
    file = tmp_path / "robot.urdf"
    file.write_text(GOOD.replace("</robot>", finger))
    arm = modelled(dataclasses.replace(bench_arm(), path=str(file)))
    assert arm.joint_names == ("s1", "s2", "s3", "e1", "e2", "w1", "w2")
    assert inertia_of(arm, arm.home_rad).shape == (7, 7)


def test_the_number_of_home_angles_must_fit_the_arm() -> None:
    six = (0.0,) * 6
    short = dataclasses.replace(bench_arm(), **{**NOT_GIVEN, "home_rad": six})
    with pytest.raises(InputError, match=r"has 7 moving joints on the way to 'flange', robot\.home_rad has 6"):
        modelled(short)


def test_joint_lists_of_different_lengths_are_refused() -> None:
    with pytest.raises(ConfigError, match="'coulomb_nm' has 2 values; allowed: 7"):
        dataclasses.replace(bench_arm(), coulomb_nm=(1.0, 1.0))


def test_a_cup_axis_of_zero_is_refused() -> None:
    with pytest.raises(ConfigError, match="'cup_axis'"):
        dataclasses.replace(bench_arm().tool, cup_axis=(0.0, 0.0, 0.0))


@pytest.mark.parametrize(
    "shape",
    [
        '<box size="0 0 0"/>',
        '<box size="1e300 nan -1"/>',
        "<box/>",
        '<cylinder radius="0.1" length="-1"/>',
        '<mesh filename="package://nowhere/hand.stl" scale="many"/>',
        '<mesh filename="hand.stl"/>',
    ],
)
@pytest.mark.parametrize("use", ["visual", "collision"])
def test_what_is_only_drawn_never_decides_what_is_simulated(tmp_path: Path, use: str, shape: str) -> None:
    first = '<link name="link_s1">'
    visual = f"{first}<{use}><geometry>{shape}</geometry><material name='x'/><material name='x'/></{use}>"
    file = tmp_path / "robot.urdf"
    file.write_text(GOOD.replace(first, visual))
    assert read(file).urdf() == read(Path(bench_arm().path)).urdf()
    arm = modelled(dataclasses.replace(bench_arm(), path=str(file)))
    assert ArmScene(arm).shapes(kendama_game()).solids
