"""URDFs as others publish them, and the peculiarities of real files: what is read, asked for or refused, and why."""

from __future__ import annotations

import csv
import dataclasses
import xml.etree.ElementTree as ET
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from kendama_cli.errors import InputError
from kendama_cli.robot_model import composed
from kendama_cli.robot_model.description import describe_arm, read_description
from kendama_cli.robot_model.model import RobotModel
from kendama_cli.schema.arrays import Array
from kendama_cli.settings.robot import PER_JOINT, RobotSettings
from tests.simulation.dart.bench_robot import bench_arm, kendama_game, modelled

INERTIAL = '<inertial><mass value="1"/><inertia ixx=".01" iyy=".01" izz=".01" ixy="0" ixz="0" iyz="0"/></inertial>'
LIMIT = '<limit lower="-2" upper="2" velocity="3" effort="80"/>'


def robot(file: Path, **given: Any) -> RobotSettings:
    """The robot of ``robot=urdf robot.path=FILE`` with what is ``given`` beside it."""
    return dataclasses.replace(
        bench_arm(), **{**dict.fromkeys(PER_JOINT), "tip_link": None, "path": str(file), **given}
    )


def link(name: str, inside: str = INERTIAL) -> str:
    return f'<link name="{name}">{inside}</link>'


def joint(name: str, parent: str, child: str, kind: str = "revolute", inside: str = LIMIT) -> str:
    ends = f'<parent link="{parent}"/><child link="{child}"/><origin xyz="0.1 0 0.2" rpy="0.3 0.2 0.1"/>'
    return f'<joint name="{name}" type="{kind}">{ends}<axis xyz="0 0.6 0.8"/>{inside}</joint>'


def arm(count: int = 5, *, root: str = "base", more: str = "", **changed: str) -> str:
    """A chain of ``count`` joints j1 ... to l1 ..., ending in the frame ``tool0``; ``changed`` parts by their name."""
    parts = {root: link(root)}
    for i in range(1, count + 1):
        parts[f"l{i}"] = link(f"l{i}")
        parts[f"j{i}"] = joint(f"j{i}", f"l{i - 1}" if i > 1 else root, f"l{i}")
    parts["tool0"] = link("tool0", "")
    parts["flange"] = joint("flange", f"l{count}", "tool0", "fixed", "")
    return f'<robot name="r">{"".join((parts | changed).values())}{more}</robot>'


def places(path: str, tip: str, names: tuple[str, ...], position: Array) -> Array:
    """Where the tip is in the root's frame, by this test's own reading of the file."""
    parents = {one.find("child").get("link"): one for one in ET.parse(path).getroot().findall("joint")}
    chain, pose = [], np.eye(4)
    while tip in parents:
        chain.insert(0, parents[tip])
        tip = parents[tip].find("parent").get("link")
    for one in chain:
        numbers = [
            np.array([float(word) for word in (("" if part is None else part.get(name)) or default).split()])
            for part, name, default in (
                (one.find("origin"), "xyz", "0 0 0"),
                (one.find("origin"), "rpy", "0 0 0"),
                (one.find("axis"), "xyz", "1 0 0"),
            )
        ]
        step = np.eye(4)
        step[:3, 3], step[:3, :3] = numbers[0], Rotation.from_euler("xyz", numbers[1]).as_matrix()
        if one.get("name") in names:
            rotation = numbers[2] / np.linalg.norm(numbers[2]) * position[names.index(one.get("name"))]
            step[:3, :3] = step[:3, :3] @ Rotation.from_rotvec(rotation).as_matrix()
        pose = pose @ step
    return pose[:3, 3]


def in_root_m(model: RobotModel, position: Array) -> Array:
    """Where the model has its tip, in the root's frame."""
    rotation, place = model.base_pose()
    return rotation.T @ (model.joint_positions_m(position)[-1] - place)


def expected() -> list[dict[str, str]]:
    table = Path(__file__).resolve().parents[3] / "shared/data/urdf/expect.csv"
    return list(csv.DictReader(table.open())) if table.is_file() else []


@pytest.mark.parametrize("row", expected(), ids=lambda row: row["file"])
def test_files_as_they_are_published_are_read_asked_about_or_refused_rightly(
    row: dict[str, str], recordings: Path
) -> None:
    given = robot(recordings / "urdf" / row["file"])
    if not row["arm_joints"]:
        with pytest.raises(InputError, match="line 11: has the marks of an unfinished git merge"):
            describe_arm(given)
        return
    found = describe_arm(given)
    n, tip = int(row["arm_joints"]), np.array([float(row[f"tip_{axis}_m"]) for axis in "xyz"])
    assert (found.tree.root, len(found.joints), found.tip_link) == (row["root_link"], n, row["tip_link"])
    _, place = composed.link_poses(found.tree, found.joint_names, np.zeros((1, n)))[found.tip_link]
    assert place[0] == pytest.approx(tip, abs=1e-6)  # as many digits as the table has
    if row["verdict"] == "refused":
        assert found.missing[0].startswith("has no mass in the links")
        return
    if row["verdict"] == "asks" and "effort" in row["needs"]:
        assert any("robot.effort_nm=[...]" in one and f"with {n} numbers" in one for one in found.missing)
        given = dataclasses.replace(given, effort_nm=(30.0,) * n)
    if "velocity" in row["needs"]:
        assert any("robot.velocity_rad_s=[...]" in one for one in found.missing)
        given = dataclasses.replace(given, velocity_rad_s=(3.0,) * n)
    if "tip_link" in row["needs"] and found.missing:
        assert f"robot.tip_link={row['tip_link']}" in found.missing[0] or row["tip_link"] in found.missing[0]
        given = dataclasses.replace(given, tip_link=row["tip_link"])
    assert found.missing if row["verdict"] == "asks" and row["file"] != "kinova_j2n6s300.urdf" else not found.missing
    model = modelled(given)
    for position in np.random.default_rng(1).uniform(-1, 1, (5, n)):
        there = places(given.path, row["tip_link"], model.joint_names, position)
        assert in_root_m(model, position) == pytest.approx(there, abs=1e-9)


@pytest.mark.parametrize("root", ["world", "cup", "tie", "ball"])
def test_a_root_may_be_called_as_other_things_are(tmp_path: Path, root: str) -> None:
    """DART drops the first joint's pose where the root is called 'world'."""
    file = tmp_path / "arm.urdf"
    file.write_text(arm(root=root))
    model, position = modelled(robot(file)), np.array([0.4, -0.3, 0.2, 0.9, -0.5])
    assert in_root_m(model, position) == pytest.approx(
        places(str(file), "tool0", model.joint_names, position), abs=1e-9
    )


def test_a_library_that_makes_another_arm_of_a_file_does_not_pass(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The names that DART takes for its own, as if nobody knew of them."""
    file = tmp_path / "arm.urdf"
    file.write_text(arm(root="world"))
    monkeypatch.setattr("kendama_cli.robot_model.description.RESERVED", ())
    with pytest.raises(InputError, match=r"link 'world' is not in what DART makes of it"):
        modelled(robot(file))


def test_a_mass_that_differs_from_the_file_s_does_not_pass(tmp_path: Path) -> None:
    file = tmp_path / "arm.urdf"
    file.write_text(arm())
    model = modelled(robot(file))
    body = model.new_body()
    composed.check_composed(model.description, body.skeleton, np.zeros(5))
    body.skeleton.getBodyNode("l3").setMass(1.0 + 1e-6)
    with pytest.raises(InputError, match="the inertia of link 'l3' differs by"):
        composed.check_composed(model.description, body.skeleton, np.zeros(5))


MIMIC = f'{LIMIT}<mimic joint="lead"/>'
GRASP = link("grasp_frame", "") + joint("gf", "l5", "grasp_frame", "fixed", "")


@pytest.mark.parametrize(
    ("more", "count", "tip"),
    [
        ("", 5, "tool0"),
        (link("jaw") + joint("gripper", "l5", "jaw"), 5, "tool0"),
        (link("moving_jaw") + joint("j6", "l5", "moving_jaw") + GRASP, 5, "tool0"),
        (link("prop") + joint("gripper", "tool0", "prop", "continuous"), 5, "tool0"),
        (link("a") + joint("wrist_gripper_roll", "tool0", "a"), 6, "a"),
        ("".join(link(n) + joint(f"m{n}", "tool0", n) for n in "abc"), 5, "tool0"),
        (link("a") + joint("lead", "tool0", "a") + link("b") + joint("f", "tool0", "b", inside=MIMIC), 5, "tool0"),
        ("".join(link(n) + joint(f"m{n}", "tool0", n, "prismatic") for n in "ab"), 5, "tool0"),
        (link("camera_link", "") + joint("c", "tool0", "camera_link", "fixed", ""), 5, "tool0"),
        (link("wheel") + joint("w", "base", "wheel", "continuous"), 5, "tool0"),
        (link("bumper", "") + joint("b", "base", "bumper", "floating", ""), 5, "tool0"),
        (link("alone", ""), 5, "tool0"),
        ('<ros2_control name="x"><joint name="j1"/><joint name="j1"/></ros2_control>', 5, "tool0"),
    ],
)
def test_the_arm_and_its_tool_frame_are_told_from_grippers_hands_and_wheels(
    tmp_path: Path, more: str, count: int, tip: str
) -> None:
    file = tmp_path / "arm.urdf"
    file.write_text(arm(more=more))
    found = read_description(robot(file))
    assert (len(found.joints), found.tip_link) == (count, tip)
    assert found.lines()[0] == f"{count} joints from 'base' to '{tip}': {', '.join(found.joint_names)}"
    assert len(modelled(robot(file)).joint_names) == count


def test_a_jaw_without_a_frame_beside_it_is_asked_about(tmp_path: Path) -> None:
    file = tmp_path / "arm.urdf"
    file.write_text(arm(more=link("jaw") + joint("gripper", "l5", "jaw"), tool0="", flange=""))
    with pytest.raises(InputError, match=r"set robot\.tip_link=l5 for an arm of 5 joints, or robot\.tip_link=jaw"):
        read_description(robot(file))
    assert len(read_description(dataclasses.replace(robot(file), tip_link="jaw")).joints) == 6


RAIL = (
    joint("rail", "base", "cart", "prismatic") + link("cart") + joint("mount", "cart", "b0", "fixed", "") + link("b0")
)


@pytest.mark.parametrize(
    ("changed", "words"),
    [
        (
            {"j1": RAIL + joint("j1", "b0", "l1")},
            r"joint 'rail' is prismatic \(a rail, lift or slide\).*robot\.locked_joints=\[rail\]",
        ),
        ({"j1": joint("j1", "base", "l1", "floating", "")}, r"joint 'j1' is floating \(a base that moves freely\)"),
        ({"j1": joint("j1", "base", "l1", "Revolute")}, "joint 'j1' is of type 'Revolute'"),
        ({"j2": joint("j2", "l1", "l2", inside='<limit lower="-2" upper="2"/>')}, "no velocity limit for 1 joint: j2"),
        ({"j2": joint("j2", "l1", "l2", inside="")}, r"robot\.lower_rad=\[\.\.\.\] and robot\.upper_rad=\[\.\.\.\]"),
        ({"l2": link("l2", ""), "l4": link("l4", "<visual/>")}, "has no mass in the links 'l2', 'l4': no setting"),
        ({"l5": link("l5", "")}, "has no mass in the link 'l5'"),
        ({"l2": link("l2", INERTIAL.replace('"1"', '"1e300"'))}, "link 'l2' has the mass '1e300'"),
        ({"j2": joint("j2", "l1", "l2").replace("0.1 0 0.2", "100 0 2e4")}, "numbers up to 1000"),
        ({"j2": joint("j2", "l1", "l2") + link("x") + link("y") + joint("xy", "x", "y")}, "has 2 trees.*base, x"),
    ],
)
def test_what_stands_in_the_way_is_called_what_it_is(tmp_path: Path, changed: dict[str, str], words: str) -> None:
    file = tmp_path / "arm.urdf"
    file.write_text(arm(**changed))
    with pytest.raises(InputError, match=words) as caught:
        read_description(robot(file))
    assert "\n" not in str(caught.value)


GIVEN = {"lower_rad": (-1.0,) * 5, "upper_rad": (1.0,) * 5, "velocity_rad_s": (2.0,) * 5, "effort_nm": (9.0,) * 5}


@pytest.mark.parametrize(
    ("changed", "given"),
    [
        ({"j1": RAIL + joint("j1", "b0", "l1")}, {"locked_joints": ("rail",)}),
        ({"j1": RAIL + joint("j1", "b0", "l1")}, {"base_link": "b0"}),
        ({"j2": joint("j2", "l1", "l2", inside="")}, GIVEN),
        ({"l2": link("l2", "")}, {}),
        ({"l2": link("l2", INERTIAL.replace(".01", "0"))}, {}),
        ({"j3": joint("j3", "l2", "l3").replace('<axis xyz="0 0.6 0.8"/>', "")}, {}),
        ({"j3": joint("j3", "l2", "l3").replace("0 0.6 0.8", "0 -3 4")}, {}),
        ({"j5": joint("j5", "l4", "l5", "continuous", '<limit velocity="1" effort="2"/>')}, {}),
    ],
)  # fmt: skip
def test_what_can_be_given_beside_the_file_or_is_not_needed_is_taken(
    tmp_path: Path, changed: dict[str, str], given: dict[str, Any]
) -> None:
    file = tmp_path / "arm.urdf"
    file.write_text(arm(**changed))
    model, position = modelled(robot(file, **given)), np.array([0.4, -0.3, 0.2, 0.9, -0.5])
    there = places(str(file), "tool0", model.joint_names, position)
    if "base_link" not in given:
        assert in_root_m(model, position) == pytest.approx(there, abs=1e-9)
    for key in {"lower_rad", "upper_rad", "velocity_rad_s", "effort_nm"} & set(given):
        assert tuple(getattr(model.limits, key)) == given[key]


PLAIN = arm()


@pytest.mark.parametrize(
    "data",
    [
        b"\xef\xbb\xbf" + PLAIN.encode(),
        ('<?xml version="1.0" encoding="utf-16"?>' + PLAIN).encode("utf-16"),
        b'\n\n <!-- licence -- with hyphens --> <?xml version="1.0" encoding="utf8"?>' + PLAIN.encode(),
        PLAIN.replace("</robot>", "<!-- \u94f0\u94fe --></robot>").encode("gb2312"),
        PLAIN.replace("<robot ", '<robot xmlns="http://www.ros.org" ').encode(),
        PLAIN.replace("</robot>", '<sensor:camera name="x"/><gazebo a="$(none)"/></robot>').encode(),
        PLAIN.replace("</robot>", '<xacro:property name="pi" value="3.14"/></robot>').encode(),
        PLAIN.replace("</robot>", '<!-- <xacro:include filename="${x}"/> --></robot>').encode(),
    ],
)  # fmt: skip
def test_what_ros_reads_is_read(tmp_path: Path, data: bytes) -> None:
    (tmp_path / "plain.urdf").write_text(PLAIN)
    (tmp_path / "arm.urdf").write_bytes(data)
    assert (
        read_description(robot(tmp_path / "arm.urdf")).urdf() == read_description(robot(tmp_path / "plain.urdf")).urdf()
    )


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "is empty"),
        ("version https://git-lfs.github.com/spec/v1\noid sha256:1", "is a pointer of Git LFS"),
        ("<html><body>404</body></html>", "is a web page, not a URDF"),
        ("<mujoco/>", "is a MuJoCo model, not a URDF"),
        ('<robot name="r"><group name="arm"/></robot>', "it is an SRDF"),
        ("<robot>\n<link name='a'>\n</robot>", r"line 3: is not well-formed XML \(mismatched tag\)"),
        ("<robot>\n<<<<<<< HEAD\n<link/>\n=======\n>>>>>>> b\n</robot>", "line 2: has the marks of an unfinished git"),
        ('<robot><xacro:arm prefix="a"/></robot>', "is a xacro file, not a URDF yet; expand it first"),
    ],
)  # fmt: skip
def test_a_file_that_is_no_urdf_is_called_what_it_is(tmp_path: Path, text: str, words: str) -> None:
    (tmp_path / "arm.urdf").write_text(text)
    with pytest.raises(InputError, match=words):
        describe_arm(robot(tmp_path / "arm.urdf"))


def test_limits_that_may_be_degrees_or_placeholders_are_named_for_all_joints_in_one_line(tmp_path: Path) -> None:
    file = tmp_path / "arm.urdf"
    file.write_text(arm().replace(LIMIT, '<limit lower="-170" upper="170" velocity="180" effort="100"/>'))
    first, second = read_description(robot(file)).doubtful
    assert first.count("j1, j2, j3, j4, j5") == 2
    assert "may be degrees" in first
    assert "100 for all 5 joints" in second
    assert not any("placeholder" in one for one in read_description(robot(file, effort_nm=(100.0,) * 5)).doubtful[1:])


def test_friction_of_the_file_is_used_where_no_setting_gives_it(tmp_path: Path) -> None:
    file = tmp_path / "arm.urdf"
    file.write_text(arm(j2=joint("j2", "l1", "l2", inside=f'{LIMIT}<dynamics damping="0.7" friction="0.4"/>')))
    model = modelled(robot(file))
    assert model.friction.viscous_nm_s.tolist() == [0.0, 0.7, 0.0, 0.0, 0.0]
    assert model.friction.coulomb_nm.tolist() == [0.0, 0.4, 0.0, 0.0, 0.0]
    assert model.description.sources["viscous_nm_s"] == "<dynamics damping>"
    own = modelled(robot(file, viscous_nm_s=(0.0,) * 5))
    assert own.friction.viscous_nm_s.tolist() == [0.0] * 5


def test_a_joint_that_turns_nothing_with_inertia_is_named(tmp_path: Path) -> None:
    """A mass on the axis of the last joint, and the cup's tie and axis on it too."""
    on_axis = joint("j5", "l4", "l5").replace("0 0.6 0.8", "0 0 1")
    nothing = INERTIAL.replace(".01", "0")
    flange = '<joint name="flange" type="fixed"><parent link="l5"/><child link="tool0"/></joint>'
    file = tmp_path / "arm.urdf"
    file.write_text(arm(j5=on_axis, l5=link("l5", nothing), flange=flange))
    tool = dataclasses.replace(bench_arm().tool, handle_m=(0.0, 0.0, 0.2), cup_axis=(0.0, 0.0, 1.0))
    light = dataclasses.replace(kendama_game().cup, radius_m=0.03, mass_kg=1e-7)
    with pytest.raises(InputError, match="joint 'j5' moves nothing that has inertia"):
        RobotModel(robot(file, tool=tool), light, 9.81)
