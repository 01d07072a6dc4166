"""Robot descriptions: from a URDF file to the bare chain that the dynamics need."""

from __future__ import annotations

import math
import os
import xml.etree.ElementTree as ET
from collections import Counter
from dataclasses import dataclass

from kendama_cli.errors import InputError

MOVING = ("revolute", "continuous")
PRINCIPAL = ("ixx", "iyy", "izz")
INERTIA = (*PRINCIPAL, "ixy", "ixz", "iyz")
FRAME_MASS_KG = 1e-6
"""Links without inertia that are fixed to another are frames; DART would give them 1 kg."""


@dataclass(frozen=True)
class Description:
    """A chain from the root link to ``tip_link``: what DART loads, and the names of its moving joints."""

    path: str
    text: str
    joint_names: tuple[str, ...]


def read_description(path: str, tip_link: str) -> Description:
    """Read the URDF at ``path``, keep links, joints and inertias, and hold every joint off the chain fixed.

    Raises InputError where it does not parse, a link or a mesh beside the file is missing, a name is missing or
    repeated, a moving link has no mass or inertia, or a joint of the chain has no limits.
    """
    root = _parse(path)
    _check_names(path, root, "link")
    _check_names(path, root, "joint")
    links = {link.get("name", ""): link for link in root.iter("link")}
    parents = _parents(path, root, links)
    if not links:
        raise InputError(path, "has no links", remedy="set robot.urdf to a URDF that describes an arm")
    if tip_link not in links:
        known = ", ".join(sorted(links))
        raise InputError(path, f"has no link '{tip_link}'", remedy=f"set robot.tip_link to one of: {known}")
    chain = _chain(path, parents, tip_link)
    names = tuple(joint.get("name", "") for joint in chain if joint.get("type") in MOVING)
    if not names:
        raise InputError(
            path, f"has no moving joint on the way to '{tip_link}'", remedy="choose another robot.tip_link"
        )
    for joint in chain:
        _check_joint(path, joint)
    on_chain = set(names)
    bare = ET.Element("robot", {"name": root.get("name", "robot")})
    for name, link in links.items():
        moved = name in parents and parents[name].get("name") in on_chain
        bare.append(_bare_link(path, name, link, moved=moved))
    for joint in root.findall("joint"):
        bare.append(_bare_joint(joint, moving=joint.get("name") in on_chain))
    return Description(path, ET.tostring(bare, encoding="unicode"), names)


def _parse(path: str) -> ET.Element:
    try:
        root = ET.parse(path).getroot()
    except ET.ParseError as error:
        line = f"line {error.position[0]}"
        raise InputError(
            path, "is not well-formed XML", where=line, remedy="repair it or choose another URDF"
        ) from None
    except (OSError, UnicodeDecodeError, ValueError, LookupError) as error:
        raise InputError(path, f"cannot be read as a URDF ({error})", remedy="set robot.urdf to a URDF file") from None
    if root.tag != "robot":
        raise InputError(
            path, f"is not a URDF: its root is <{root.tag}>, not <robot>", remedy="set robot.urdf to a URDF"
        )
    for mesh in root.iter("mesh"):
        name = mesh.get("filename", "")
        file = name.removeprefix("file://")
        if "://" not in file and not os.path.exists(os.path.join(os.path.dirname(path), file)):
            raise InputError(path, f"names the mesh '{name}', which is not there", remedy="put it there or drop it")
    return root


def _check_names(path: str, root: ET.Element, tag: str) -> None:
    counts = Counter(element.get("name", "") for element in root.findall(tag))
    for name, count in counts.items():
        if not name or count > 1:
            problem = f"has {count} {tag}s called '{name}'" if name else f"has a {tag} without a name"
            raise InputError(path, problem, remedy=f"give every {tag} a name of its own")


def _check_numbers(path: str, where: str, element: ET.Element) -> None:
    """Raise InputError for a place, a direction or an inertia below ``element`` that is not made of numbers."""
    for tag, names, count in (("origin", ("xyz", "rpy"), 3), ("axis", ("xyz",), 3), ("inertia", INERTIA, 1)):
        part = element.find(tag)
        for name in names if part is not None else ():
            text = part.get(name) if part is not None else None
            values = [_number(word) for word in (text or "").split()]
            if text is not None and (len(values) != count or None in values):
                wanted = "one number" if count == 1 else f"{count} numbers"
                raise InputError(path, f"has <{tag} {name}='{text}'>", where=where, remedy=f"give {wanted}")
            if tag == "axis" and text is not None and not any(values):
                raise InputError(path, "has an axis without direction", where=where, remedy="give a unit vector")


def _parents(path: str, root: ET.Element, links: dict[str, ET.Element]) -> dict[str, ET.Element]:
    parents: dict[str, ET.Element] = {}
    for joint in root.findall("joint"):
        for end in ("parent", "child"):
            element = joint.find(end)
            name = "" if element is None else element.get("link", "")
            if name not in links:
                where = f"joint '{joint.get('name')}'"
                raise InputError(
                    path, f"has no link '{name}' for the {end}", where=where, remedy="name a link of the file"
                )
        parents[_link(joint, "child")] = joint
    return parents


def _link(joint: ET.Element, end: str) -> str:
    element = joint.find(end)
    return "" if element is None else element.get("link", "")


def _chain(path: str, parents: dict[str, ET.Element], tip_link: str) -> list[ET.Element]:
    chain: list[ET.Element] = []
    link = tip_link
    while link in parents:
        joint = parents[link]
        if joint in chain:
            raise InputError(path, f"has a ring of joints through '{link}'", remedy="a URDF must be a tree")
        chain.insert(0, joint)
        link = _link(joint, "parent")
    return chain


def _check_joint(path: str, joint: ET.Element) -> None:
    name, kind = joint.get("name"), joint.get("type")
    where = f"joint '{name}'"
    _check_numbers(path, where, joint)
    if kind not in (*MOVING, "fixed"):
        raise InputError(path, f"is of type '{kind}'", where=where, remedy="allowed: revolute, continuous, fixed")
    if kind == "fixed":
        return
    limit = joint.find("limit")
    wanted = ("velocity", "effort", "lower", "upper") if kind == "revolute" else ("velocity", "effort")
    values = {key: _number(None if limit is None else limit.get(key)) for key in wanted}
    for key in wanted:
        if values[key] is None or (key in ("velocity", "effort") and not (values[key] or 0.0) > 0):
            raise InputError(path, f"has no usable {key} limit", where=where, remedy="give it in <limit .../>")
    if kind == "revolute" and not (values["lower"] or 0.0) < (values["upper"] or 0.0):
        raise InputError(
            path, "has a lower limit that is not below its upper one", where=where, remedy="correct <limit>"
        )


def _number(text: str | None) -> float | None:
    try:
        value = float(text or "")
    except ValueError:
        return None
    return value if math.isfinite(value) else None


def _bare_link(path: str, name: str, link: ET.Element, *, moved: bool) -> ET.Element:
    bare = ET.Element("link", {"name": name})
    inertial = link.find("inertial")
    mass = None if inertial is None else inertial.find("mass")
    if inertial is None and not moved:
        inertial = ET.Element("inertial")
        ET.SubElement(inertial, "mass", {"value": str(FRAME_MASS_KG)})
        tiny = dict.fromkeys(INERTIA, "0") | dict.fromkeys(PRINCIPAL, "1e-9")
        ET.SubElement(inertial, "inertia", tiny)
    elif inertial is None or not (_number(None if mass is None else mass.get("value")) or 0.0) > 0:
        raise InputError(
            path, "has no mass", where=f"link '{name}'", remedy="give it an <inertial> with a positive mass"
        )
    where = f"link '{name}'"
    _check_numbers(path, where, inertial)
    inertia = inertial.find("inertia")
    for moment in PRINCIPAL if moved else ():
        if not (_number(None if inertia is None else inertia.get(moment)) or 0.0) > 0:
            raise InputError(path, f"has no positive {moment}", where=where, remedy="give it in <inertia .../>")
    bare.append(inertial)
    return bare


def _bare_joint(joint: ET.Element, *, moving: bool) -> ET.Element:
    kind = (joint.get("type") or "") if moving else "fixed"
    bare = ET.Element("joint", {"name": joint.get("name", ""), "type": kind})
    keep = ("parent", "child", "origin", "axis", "limit") if moving else ("parent", "child", "origin")
    bare.extend([part for tag in keep if (part := joint.find(tag)) is not None])
    return bare
