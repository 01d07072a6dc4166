"""A file's tree at its edges: sizes, lines, numbers, masses, several trees."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from kendama_cli.errors import InputError
from kendama_cli.robot_model.urdf_tree import UrdfTree, masses_of, number, read_tree, read_xml


def _joint(parent: int, child: int, kind: str = "revolute") -> str:
    return f'<joint name="j{child}" type="{kind}"><parent link="l{parent}"/><child link="l{child}"/></joint>'


def _tree(folder: Path, *inside: str) -> UrdfTree:
    (folder / "arm.urdf").write_text(f'<robot name="r">{"".join(inside)}</robot>')
    return read_tree(str(folder / "arm.urdf"))


def _links(*bodies: str) -> str:
    return "".join(f'<link name="l{k}">{body}</link>' for k, body in enumerate(bodies))


def _heavy(kg: str, ixx: str = "0.1", ixy: str = "0") -> str:
    moments = f'ixx="{ixx}" iyy="0.1" izz="0.1" ixy="{ixy}" ixz="0" iyz="0"' if ixx else ""
    return f'<inertial><mass value="{kg}"/><inertia {moments}/></inertial>'


@pytest.mark.parametrize(
    ("bodies", "massless", "wrong", "points"),
    [
        (("", _heavy("1"), _heavy("2")), {"l0"}, [], []),
        (("", "", _heavy("2")), {"l0", "l1"}, [], []),  # a frame at the place of another joint
        (("", "", "", _heavy("2")), {"l0", "l1", "l2"}, [], []),  # three joints at one place
        (
            ("", "", "", "", _heavy("2")),
            {"l0", "l1", "l2", "l3"},
            ["has no mass in the links 'l1', 'l2', 'l3': no"],
            [],
        ),
        (("", "<visual/>", _heavy("2")), {"l0", "l1"}, ["has no mass in the link 'l1': no setting"], []),
        (("", _heavy("1"), ""), {"l0", "l2"}, ["has no mass in the link 'l2': no setting"], []),
        (("", _heavy("-1"), _heavy("2")), {"l0", "l1"}, ["has no mass in the link 'l1'", "has the mass '-1'"], []),
        ((_heavy("x"), _heavy("2")), {"l0"}, [], []),  # the base does not move
        (("", _heavy("1", "-0.1")), {"l0"}, ["link 'l1' has ixx='-0.1'"], []),
        (("", _heavy("1", "0.1", "-0.1")), {"l0"}, [], []),
        (("", _heavy("1", "0.1", "x")), {"l0"}, ["link 'l1' has ixy='x'"], []),
        (("", _heavy("1", "")), {"l0"}, [], ["'l1'"]),
        (("", _heavy("0.001", "")), {"l0"}, [], []),  # not worth a word
        (("", _heavy("0.0011", "")), {"l0"}, [], ["'l1'"]),
    ],
)
def test_links_that_need_a_mass_or_inertia_are_told_and_frames_at_one_place_are_not(
    tmp_path: Path, bodies: tuple[str, ...], massless: set[str], wrong: list[str], points: list[str]
) -> None:
    tree = _tree(tmp_path, _links(*bodies), *(_joint(k, k + 1) for k in range(len(bodies) - 1)))
    found = masses_of(tree, tree.joints)
    assert found[0] == massless
    assert len(found[1]) == len(wrong)
    assert all(part in told for part, told in zip(wrong, found[1], strict=True)), found[1]
    assert found[2] == points


def test_a_number_is_finite_and_at_most_what_an_arm_can_have() -> None:
    assert [number(one) for one in ("1e9", "-1e9", " 2.5 ")] == [1e9, -1e9, 2.5]
    assert [number(one) for one in ("1.1e9", "-1.1e9", "nan", "inf", "x", "", None)] == [None] * 7


def test_lone_links_are_left_out_and_two_trees_are_refused(tmp_path: Path) -> None:
    joined = _tree(tmp_path, _links(*[""] * 5), _joint(0, 1), _joint(1, 2)).joined()
    assert (joined.root, set(joined.links), len(joined.joints)) == ("l0", {"l0", "l1", "l2"}, 2)
    assert [one.get("name") for one in joined.chain("l2")] == ["j1", "j2"]
    beyond = joined.beyond("l1")
    assert (beyond.root, set(beyond.links), [one.get("name") for one in beyond.joints]) == ("l1", {"l1", "l2"}, ["j2"])
    with pytest.raises(InputError, match=r"has 2 trees of links .*set robot\.base_link to one of: l0, l2"):
        _tree(tmp_path, _links(*[""] * 4), _joint(0, 1), _joint(2, 3)).joined()
    assert set(_tree(tmp_path, _links("", "")).joined().links) == {"l0"}


def test_lines_are_those_of_the_file_and_what_is_too_large_is_not_read(tmp_path: Path) -> None:
    file = tmp_path / "arm.urdf"
    file.write_text('<?xml version="1.0"?>\n<!-- one\n-- two -->\n<robot>\n<link name="a">\n</robot>\n')
    with pytest.raises(InputError, match=r"line 6: is not well-formed XML \(mismatched tag\)"):
        read_xml(str(file))
    file.write_text("<robot>\n<link name='a'/>\n<<<<<<< HEAD\n</robot>\n")
    with pytest.raises(InputError, match="line 3: has the marks of an unfinished git merge"):
        read_xml(str(file))
    file.write_text('<robot xmlns:x="http://www.ros.org/wiki/xacro"><x:box/></robot>')
    with pytest.raises(InputError, match="is a xacro file"):
        read_xml(str(file))
    file.write_text('<robot name="r">')
    os.truncate(file, 64 * 2**20 + 2**19 + 2**18)
    with pytest.raises(InputError, match="has 65 MB; allowed for a URDF: 64 MB"):
        read_xml(str(file))
