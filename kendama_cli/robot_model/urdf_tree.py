"""A URDF file as a tree of links and joints."""

from __future__ import annotations

import os
import xml.etree.ElementTree as ET
from collections import Counter
from collections.abc import Collection
from dataclasses import dataclass
from pathlib import Path

from kendama_cli.errors import InputError

MOVING = ("revolute", "continuous")
SHAPES = {"box": {"size": 3}, "cylinder": {"radius": 1, "length": 1}, "sphere": {"radius": 1}}
LARGEST_M = 1e3
XACRO = "{http://www.ros.org/wiki/xacro}"


@dataclass(frozen=True)
class UrdfTree:
    """Links by name, joints in the file's order, and for every link but the root the joint that holds it."""

    path: str
    name: str
    links: dict[str, ET.Element]
    joints: tuple[ET.Element, ...]
    parents: dict[str, ET.Element]

    def chain(self, link: str) -> list[ET.Element]:
        """The joints from the root to ``link``; raises InputError for a ring."""
        chain: list[ET.Element] = []
        while link in self.parents:
            joint = self.parents[link]
            if joint in chain:
                raise InputError(self.path, f"has a ring of joints through '{link}'", remedy="a URDF must be a tree")
            chain.insert(0, joint)
            link = end(joint, "parent")
        return chain

    def beyond(self, base_link: str) -> UrdfTree:
        """The tree that hangs on ``base_link``; raises InputError where there is no such link."""
        if base_link not in self.links:
            known = ", ".join(sorted(self.links))
            raise InputError(self.path, f"has no link '{base_link}'", remedy=f"set robot.base_link to one of: {known}")
        held = {name for name in self.links if any(end(one, "parent") == base_link for one in self.chain(name))}
        joints = tuple(joint for joint in self.joints if end(joint, "child") in held)
        links = {name: link for name, link in self.links.items() if name in held or name == base_link}
        return UrdfTree(self.path, self.name, links, joints, {end(joint, "child"): joint for joint in joints})

    def longest(self, held_joints: Collection[str]) -> str:
        """The link at the end of the chain with the most moving joints; where two arms are alike, the user must say."""
        chains = {link: [one for one in self.chain(link) if one.get("name") not in held_joints] for link in self.links}
        turning = {
            link: [one for one in chain if one.get("type") in MOVING]
            for link, chain in chains.items()
            if all(one.get("type") in (*MOVING, "fixed") and one.find("mimic") is None for one in chain)
        }
        most = max((len(joints) for joints in turning.values()), default=0)
        # of the links that hang on the same last joint the farthest is where makers put the flange
        arms: dict[str, str] = {}
        for link in sorted(turning, key=lambda one: len(chains[one])):
            if len(turning[link]) == most:
                arms[turning[link][-1].get("name", "") if most else ""] = link
        if len(arms) > 1:
            remedy = f"set robot.tip_link to one of: {', '.join(arms.values())}"
            raise InputError(self.path, f"has {len(arms)} chains of {most} moving joints", remedy=remedy)
        return next(iter(arms.values()))


def end(joint: ET.Element, side: str) -> str:
    """The name of the link on the ``parent`` or ``child`` side of ``joint``."""
    element = joint.find(side)
    return "" if element is None else element.get("link", "")


def read_tree(path: str) -> UrdfTree:
    """Read the URDF at ``path``.

    Meshes are not needed: those of ROS packages may be elsewhere. Raises InputError where it does not parse, a link or
    a mesh beside the file is missing, or a name is missing or repeated.
    """
    root = _parse(path)
    _check_names(path, root, "link")
    _check_names(path, root, "joint")
    links = {link.get("name", ""): link for link in root.findall("link")}
    if not links:
        raise InputError(path, "has no links", remedy="set robot.path to a URDF that describes an arm")
    for name, link in links.items():
        for mesh in link.iter("mesh"):
            _check_mesh(path, name, mesh.get("filename", ""))
        _check_shapes(path, name, link)
    joints = tuple(root.findall("joint"))
    for joint in joints:
        for side in ("parent", "child"):
            if end(joint, side) not in links:
                problem = f"has no link '{end(joint, side)}' for the {side}"
                where = f"joint '{joint.get('name')}'"
                raise InputError(path, problem, where=where, remedy="name a link of the file")
    return UrdfTree(path, root.get("name", "robot"), links, joints, {end(joint, "child"): joint for joint in joints})


def _check_shapes(path: str, name: str, link: ET.Element) -> None:
    """Raise InputError for a box, cylinder or sphere without a size; nothing draws them, others would."""
    for tag, sizes in SHAPES.items():
        for shape in link.iter(tag):
            for size, count in sizes.items():
                words = shape.get(size, "").split()
                if len(words) != count or not all(_is_length(word) for word in words):
                    problem = f"has <{tag} {size}='{shape.get(size, '')}'>"
                    wanted = f"give {count} positive numbers" if count > 1 else "give a positive number"
                    raise InputError(path, problem, where=f"link '{name}'", remedy=f"{wanted} up to {LARGEST_M:g} m")


def _is_length(word: str) -> bool:
    try:
        return 0 < float(word) <= LARGEST_M
    except ValueError:
        return False


def _parse(path: str) -> ET.Element:
    try:
        root = ET.parse(path).getroot()
    except ET.ParseError as error:
        line = f"line {error.position[0]}"
        raise InputError(
            path, "is not well-formed XML", where=line, remedy="repair it or choose another URDF"
        ) from None
    except (OSError, UnicodeDecodeError, ValueError, LookupError) as error:
        raise InputError(path, f"cannot be read as a URDF ({error})", remedy="set robot.path to a URDF file") from None
    if root.tag != "robot":
        raise InputError(
            path, f"is not a URDF: its root is <{root.tag}>, not <robot>", remedy="set robot.path to a URDF"
        )
    if any(XACRO in element.tag for element in root.iter()):
        name = os.path.basename(path)
        plain = name.removesuffix(".xacro").removesuffix(".urdf")
        plain += "_plain.urdf" if name.endswith(".urdf") else ".urdf"
        remedy = f"expand it first: xacro {name} > {plain}"
        raise InputError(path, "is a xacro file, not a URDF yet", remedy=remedy)
    return root


def _check_mesh(path: str, link: str, name: str) -> None:
    if name.startswith("package://"):
        package, _, inside = name.removeprefix("package://").partition("/")
        above = [folder for folder in Path(path).resolve().parents if folder.name == package]
        missing = bool(package and above) and not (above[0] / inside).exists()
    else:
        file = name.removeprefix("file://")
        missing = "://" not in file and not os.path.exists(os.path.join(os.path.dirname(path), file))
    if missing:
        problem = f"names the mesh '{name}', which is not there"
        raise InputError(path, problem, where=f"link '{link}'", remedy="put it there or drop it from the link")


def _check_names(path: str, root: ET.Element, tag: str) -> None:
    counts = Counter(element.get("name", "") for element in root.findall(tag))
    for name, count in counts.items():
        if not name or count > 1:
            problem = f"has {count} {tag}s called '{name}'" if name else f"has a {tag} without a name"
            raise InputError(path, problem, remedy=f"give every {tag} a name of its own")
