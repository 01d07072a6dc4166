"""A URDF file as a tree of links and joints."""

from __future__ import annotations

import codecs
import os
import re
import xml.etree.ElementTree as ET
from collections import Counter
from collections.abc import Collection
from dataclasses import dataclass
from xml.parsers import expat

from kendama_cli.errors import InputError

MOST_BYTES = 64 * 2**20
MERGE_MARK = re.compile(r"^(<{7} |={7}\s*$|>{7} )", re.MULTILINE)
OTHERS = {
    "sdf": "an SDF model",
    "mujoco": "a MuJoCo model",
    "mujocoinclude": "a MuJoCo model",
    "COLLADA": "a COLLADA mesh",
    "html": "a web page",
    "launch": "a ROS launch file",
    "package": "a ROS package manifest",
}
"""Files that stand beside a URDF or are saved in its place, by their root element."""


def read_xml(path: str) -> ET.Element:
    """Return the element ``<robot>`` of the URDF at ``path``.

    Comments are dropped before XML is parsed, and namespaces are not resolved, as in ROS's own reader: comments with
    two hyphens and prefixes that nobody declares are frequent in real files. Raises InputError, naming the line where
    there is one, for what is no URDF: another format, a file to be expanded by xacro, a git merge left unfinished.
    """
    text = _text(path)
    plain = re.sub(r"<!--.*?-->|<\?xml.*?\?>", _lines_of, text, flags=re.DOTALL)
    builder = ET.TreeBuilder()
    parser = expat.ParserCreate()
    parser.StartElementHandler, parser.EndElementHandler = builder.start, builder.end
    try:
        parser.Parse(plain, True)
    except (expat.ExpatError, UnicodeEncodeError) as error:
        raise _not_xml(path, plain, error) from None
    root = builder.close()
    if root.tag != "robot":
        is_kind = f"is {kind}, not a URDF" if (kind := OTHERS.get(root.tag)) else "is not a URDF"
        problem = f"{is_kind}: its root is <{root.tag}>, not <robot>"
        raise InputError(path, problem, remedy="set robot.path to a URDF")
    if _is_xacro(root):
        name = os.path.basename(path)
        expanded = name.removesuffix(".xacro").removesuffix(".urdf")
        expanded += "_plain.urdf" if name.endswith(".urdf") else ".urdf"
        remedy = f"expand it first: xacro {name} > {expanded}"
        raise InputError(path, "is a xacro file, not a URDF yet", remedy=remedy)
    return root


def _text(path: str) -> str:
    """Read the characters of the file, in UTF-8, in the encoding that it declares, or byte for byte."""
    try:
        size = os.path.getsize(path)
        if size > MOST_BYTES:
            problem = f"has {size / 2**20:.0f} MB; allowed for a URDF: {MOST_BYTES / 2**20:.0f} MB"
            raise InputError(path, problem, remedy="set robot.path to a URDF file")
        with open(path, "rb") as file:
            data = file.read(MOST_BYTES)
    except (OSError, ValueError) as error:
        raise InputError(path, f"cannot be read as a URDF ({error})", remedy="set robot.path to a URDF file") from None
    if not data.strip():
        raise InputError(path, "is empty", remedy="set robot.path to a URDF file")
    if data.startswith(b"version https://git-lfs"):
        raise InputError(path, "is a pointer of Git LFS, not the file itself", remedy="fetch it: git lfs pull")
    declared = re.match(rb"\s*<\?xml[^>]*encoding=[\"']([\w.-]+)", data)
    wide = data.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE))
    for encoding in ("utf-16",) if wide else ("utf-8-sig", declared.group(1).decode() if declared else "latin-1"):
        try:
            return data.decode(encoding)
        except (UnicodeError, LookupError):
            continue
    return data.decode("latin-1")


def _lines_of(found: re.Match[str]) -> str:
    """Return the line ends of the text that is dropped, so that the lines after it keep their numbers."""
    return "\n" * found.group().count("\n")


def _not_xml(path: str, text: str, error: Exception) -> InputError:
    if mark := MERGE_MARK.search(text):
        line = f"line {text.count(chr(10), 0, mark.start()) + 1}"
        remedy = "finish the merge: keep one of both sides and delete the marks <<<<<<<, ======= and >>>>>>>"
        return InputError(path, "has the marks of an unfinished git merge", where=line, remedy=remedy)
    remedy = "repair it or choose another URDF"
    if not isinstance(error, expat.ExpatError):
        return InputError(path, "is not well-formed XML", remedy=remedy)
    problem = f"is not well-formed XML ({expat.ErrorString(error.code)})"
    return InputError(path, problem, where=f"line {error.lineno}", remedy=remedy)


def _is_xacro(root: ET.Element) -> bool:
    """Return True if something is left to expand; a property that nothing uses, or a prefix declared, is not."""
    prefixes = [name[6:] for name, value in root.attrib.items() if name.startswith("xmlns:") and "xacro" in value]
    for element in root.iter():
        prefix, _, kind = element.tag.rpartition(":")
        if prefix and prefix in {*prefixes, "xacro"} and kind not in ("property", "arg"):
            return True
        if any("${" in value or "$(arg" in value for value in element.attrib.values()) and not prefix:
            return True
    return False


MOST = 1e9
"""No length, mass, inertia or limit of an arm is beyond it, in any unit."""
MOVING = ("revolute", "continuous")


@dataclass(frozen=True)
class UrdfTree:
    """Links by name, joints in the file's order, and for every link but the root the joint that holds it."""

    path: str
    name: str
    links: dict[str, ET.Element]
    joints: tuple[ET.Element, ...]
    parents: dict[str, ET.Element]

    @property
    def root(self) -> str:
        """The link on which all others hang; the first where there are several."""
        return next(link for link in self.links if link not in self.parents)

    def chain(self, link: str) -> list[ET.Element]:
        """Return the joints from the root to ``link``; raises InputError for a ring."""
        chain: list[ET.Element] = []
        while link in self.parents:
            joint = self.parents[link]
            if joint in chain:
                raise InputError(self.path, f"has a ring of joints through '{link}'", remedy="a URDF must be a tree")
            chain.insert(0, joint)
            link = end(joint, "parent")
        return chain

    def beyond(self, base_link: str) -> UrdfTree:
        """Return the tree beyond ``base_link``; raises InputError if there is no such link."""
        if base_link not in self.links:
            known = ", ".join(sorted(self.links))
            raise InputError(self.path, f"has no link '{base_link}'", remedy=f"set robot.base_link to one of: {known}")
        held = {name for name in self.links if any(end(one, "parent") == base_link for one in self.chain(name))}
        joints = tuple(joint for joint in self.joints if end(joint, "child") in held)
        links = {name: link for name, link in self.links.items() if name in held or name == base_link}
        return UrdfTree(self.path, self.name, links, joints, {end(joint, "child"): joint for joint in joints})

    def joined(self) -> UrdfTree:
        """Return the one tree of joints without unjoined links; raises InputError for two trees or a ring."""
        for link in self.links:
            self.chain(link)
        roots = [link for link in self.links if link not in self.parents]
        held = {end(joint, "parent") for joint in self.joints}
        trees = [link for link in roots if link in held] or roots[:1]
        if len(trees) > 1:
            remedy = f"set robot.base_link to one of: {', '.join(trees)}"
            raise InputError(self.path, f"has {len(trees)} trees of links that no joint connects", remedy=remedy)
        return self.beyond(trees[0])


def end(joint: ET.Element, side: str) -> str:
    """Return the name of the link on the ``parent`` or ``child`` side of ``joint``."""
    element = joint.find(side)
    return "" if element is None else element.get("link", "")


def named(joints: Collection[ET.Element]) -> str:
    """Return the names of ``joints``, in one line."""
    return ", ".join(joint.get("name", "") for joint in joints)


def number(text: str | None) -> float | None:
    """Return the number in ``text``; None if it is not a number or beyond MOST."""
    try:
        value = float(text or "")
    except ValueError:
        return None
    return value if abs(value) <= MOST else None


def numbers(element: ET.Element | None, name: str, default: tuple[float, ...]) -> tuple[float, ...]:
    """Return the numbers of the attribute ``name``, or ``default`` if there is none; raises ValueError for others."""
    text = None if element is None else element.get(name)
    return default if text is None else tuple(float(word) for word in text.split())


def read_tree(path: str) -> UrdfTree:
    """Read the links and joints of the URDF at ``path``: what moves and what weighs, never what is only drawn.

    Raises InputError where it is no URDF (see read_xml), a link is missing or hangs on two joints, or a name is missing
    or repeated.
    """
    root = read_xml(path)
    _check_names(path, root, "link")
    _check_names(path, root, "joint")
    links = {link.get("name", ""): link for link in root.findall("link")}
    if not links:
        semantic = root.find("group") is not None or root.find("disable_collisions") is not None
        problem = "has no links" + (": it is an SRDF, which says how to plan with a robot" if semantic else "")
        raise InputError(path, problem, remedy="set robot.path to a URDF that describes an arm")
    joints = tuple(root.findall("joint"))
    parents: dict[str, ET.Element] = {}
    for joint in joints:
        where = f"joint '{joint.get('name')}'"
        for side in ("parent", "child"):
            if end(joint, side) not in links:
                problem = f"has no link '{end(joint, side)}' for the {side}"
                raise InputError(path, problem, where=where, remedy="name a link of the file")
        first = parents.setdefault(end(joint, "child"), joint)
        if first is not joint:
            problem = f"hangs on two joints, {named((first, joint))}"
            where = f"link '{end(joint, 'child')}'"
            raise InputError(path, problem, where=where, remedy="a URDF must be a tree: leave one of them out")
    return UrdfTree(path, root.get("name", "robot"), links, joints, parents)


def _check_names(path: str, root: ET.Element, tag: str) -> None:
    counts = Counter(element.get("name", "") for element in root.findall(tag))
    for name, count in counts.items():
        if not name or count > 1:
            problem = f"has {count} {tag}s called '{name}'" if name else f"has a {tag} without a name"
            raise InputError(path, problem, remedy=f"give every {tag} a name of its own")


PRINCIPAL = ("ixx", "iyy", "izz")
INERTIA = (*PRINCIPAL, "ixy", "ixz", "iyz")
FRAMES = 1
"""Bodies without mass that may follow another: three joints at one place."""
TOLD_KG = 1e-3
"""A lighter link without inertia is not worth a word."""


def masses_of(tree: UrdfTree, joints: tuple[ET.Element, ...]) -> tuple[frozenset[str], list[str], list[str]]:
    """Return links without mass, what is said of bodies that need one, and links with mass but without inertia.

    A body is a link that a joint of the arm moves, with all that is fixed to it. One without mass is a frame if nothing
    of it is drawn and one of the next bodies has mass: makers put two or three joints at one place so.
    """
    massless, wrong, points = set[str](), list[str](), list[str]()
    bodies: dict[str, float] = {end(joint, "child"): 0.0 for joint in joints}
    shown: dict[str, bool] = dict.fromkeys(bodies, False)
    for name, link in tree.links.items():
        inertial = link.find("inertial")
        mass = None if inertial is None else inertial.find("mass")
        text = None if mass is None else mass.get("value")
        kg = 0.0 if text is None else number(text)
        moved = [end(joint, "child") for joint in tree.chain(name) if joint in joints]
        if kg is None or kg < 0:
            if moved:
                wrong.append(f"link '{name}' has the mass '{text}'; it must be a positive number [kg]")
            kg = 0.0
        if kg == 0:
            massless.add(name)
        if moved:
            bodies[moved[-1]] += kg
            principal, negative = _principal(inertial)
            shown[moved[-1]] |= any(principal) or any(link.find(tag) is not None for tag in ("visual", "collision"))
            if kg > 0 and negative:
                wrong.append(f"link '{name}' has {negative}; a moment of inertia is a number, and not negative")
            elif kg > TOLD_KG and not any(principal):
                points.append(f"'{name}'")
    order = list(bodies)
    light = [body for body in order if bodies[body] == 0]
    if any(
        shown[one] or not any(bodies[body] for body in order[order.index(one) + 1 :][: FRAMES + 1]) for one in light
    ):
        listed = ", ".join(f"'{body}'" for body in light)
        reason = f"has no mass in the link{'s' if len(light) > 1 else ''} {listed}"
        wrong.insert(0, f"{reason}: no setting can give it; write their <inertial>, or choose another URDF")
    return frozenset(massless), wrong, points


def _principal(inertial: ET.Element | None) -> tuple[list[float], str]:
    """Return the moments of inertia about the three axes, and the first that is negative or not a number, in words."""
    inertia = None if inertial is None else inertial.find("inertia")
    texts = {name: "0" if inertia is None else inertia.get(name, "0") for name in INERTIA}
    values = {name: number(text) for name, text in texts.items()}
    bad = [f"{name}='{texts[name]}'" for name, value in values.items() if value is None]
    bad += [f"{name}='{texts[name]}'" for name in PRINCIPAL if (values[name] or 0.0) < 0]
    return [values[name] or 0.0 for name in PRINCIPAL], bad[0] if bad else ""
