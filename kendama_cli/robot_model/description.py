"""Robot descriptions: from a URDF file to the bare chain that the dynamics need."""

from __future__ import annotations

import math
import xml.etree.ElementTree as ET
from collections.abc import Collection
from dataclasses import dataclass

from kendama_cli.errors import InputError
from kendama_cli.robot_model.urdf_tree import MOVING, UrdfTree, end, read_tree

PRINCIPAL = ("ixx", "iyy", "izz")
INERTIA = (*PRINCIPAL, "ixy", "ixz", "iyz")
FRAME_MASS_KG = 1e-6
"""Links without inertia that are fixed to another are frames; DART would give them 1 kg."""


@dataclass(frozen=True)
class Description:
    """A chain from the base link to ``tip_link``: what DART loads, and the names of its moving joints."""

    path: str
    text: str
    tip_link: str
    joint_names: tuple[str, ...]


def read_description(
    path: str, base_link: str | None, tip_link: str | None, held_joints: Collection[str] = ()
) -> Description:
    """Read the URDF at ``path``, keep links, joints and inertias, and hold ``held_joints`` and all off the chain fixed.

    What is before ``base_link`` is left out; without ``tip_link`` the end of the chain with the most moving joints is
    taken. Raises InputError where the file cannot be used (see read_tree), one of these names is not in it, a moving
    link has no mass or inertia, or a joint of the chain has no limits.
    """
    tree = read_tree(path)
    if base_link is not None:
        tree = tree.beyond(base_link)
    for name in held_joints:
        if name not in (known := [joint.get("name", "") for joint in tree.joints]):
            raise InputError(
                path, f"has no joint '{name}'", remedy=f"set robot.held_joints to some of: {', '.join(known)}"
            )
    if tip_link is None:
        tip_link = tree.longest(held_joints)
    if tip_link not in tree.links:
        beyond = f" beyond '{base_link}'" if base_link else ""
        remedy = f"set robot.tip_link to one of: {', '.join(sorted(tree.links))}"
        raise InputError(path, f"has no link '{tip_link}'{beyond}", remedy=remedy)
    chain = [joint for joint in tree.chain(tip_link) if joint.get("name") not in held_joints]
    for joint in chain:
        _check_joint(path, joint)
    names = tuple(joint.get("name", "") for joint in chain if joint.get("type") in MOVING)
    if not names:
        raise InputError(
            path, f"has no moving joint on the way to '{tip_link}'", remedy="choose another robot.tip_link"
        )
    bare = ET.Element("robot", {"name": tree.name})
    carried = _carried_mass(tree, names)
    for name, link in tree.links.items():
        moved = name in tree.parents and tree.parents[name].get("name") in names
        bare.append(_bare_link(path, name, link, moved=moved, carries=carried.get(name, 0.0) > 0))
    for joint in tree.joints:
        bare.append(_bare_joint(joint, moving=joint.get("name") in names))
    return Description(path, ET.tostring(bare, encoding="unicode"), tip_link, names)


def _carried_mass(tree: UrdfTree, moving: Collection[str]) -> dict[str, float]:
    """The mass of every link that moves, with all that is fixed to it."""
    carried: dict[str, float] = {}
    for name, link in tree.links.items():
        holder = name
        for joint in reversed(tree.chain(name)):
            if joint.get("name") in moving:
                break
            holder = end(joint, "parent")
        mass = link.find("inertial/mass")
        carried[holder] = carried.get(holder, 0.0) + (_number(None if mass is None else mass.get("value")) or 0.0)
    return carried


def _check_numbers(path: str, where: str, element: ET.Element) -> None:
    """Raise InputError for a place, a direction or an inertia below ``element`` that is not made of numbers."""
    fixed = element.get("type") == "fixed"  # its axis means nothing, and makers leave zeros there
    for tag, names, count in (("origin", ("xyz", "rpy"), 3), ("axis", ("xyz",), 3), ("inertia", INERTIA, 1)):
        part = element.find(tag)
        for name in names if part is not None else ():
            text = part.get(name) if part is not None else None
            values = [_number(word) for word in (text or "").split()]
            if text is not None and (len(values) != count or None in values):
                wanted = "one number" if count == 1 else f"{count} numbers"
                raise InputError(path, f"has <{tag} {name}='{text}'>", where=where, remedy=f"give {wanted}")
            if tag == "axis" and not fixed and text is not None and not any(values):
                raise InputError(path, "has an axis without direction", where=where, remedy="give a unit vector")


def _check_joint(path: str, joint: ET.Element) -> None:
    name, kind = joint.get("name"), joint.get("type")
    where = f"joint '{name}'"
    _check_numbers(path, where, joint)
    if kind not in (*MOVING, "fixed"):
        remedy = (
            f"allowed on the way to the tip: revolute, continuous, fixed; or hold it: robot.held_joints=[{name}], "
            "or choose another robot.tip_link"
        )
        raise InputError(path, f"is of type '{kind}'", where=where, remedy=remedy)
    if kind == "fixed":
        return
    mimic = joint.find("mimic")
    if mimic is not None:
        remedy = f"choose a robot.tip_link before it or hold it: robot.held_joints=[{name}]"
        raise InputError(path, f"mimics joint '{mimic.get('joint')}'", where=where, remedy=remedy)
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


def _bare_link(path: str, name: str, link: ET.Element, *, moved: bool, carries: bool) -> ET.Element:
    """The link with its inertia; where it has none, that of a frame, which a moving link may be if it carries mass."""
    bare = ET.Element("link", {"name": name})
    where = f"link '{name}'"
    inertial = link.find("inertial")
    if inertial is not None:
        _check_numbers(path, where, inertial)
    mass = None if inertial is None else inertial.find("mass")
    kg = 0.0 if mass is None else _number(mass.get("value"))
    if kg is None or kg < 0 or (kg == 0 and moved and not carries):
        problem = "has no mass" if kg == 0 else f"has the mass '{'' if mass is None else mass.get('value')}'"
        raise InputError(path, problem, where=where, remedy="give it an <inertial> with a positive mass")
    if inertial is None or kg == 0:
        inertial = ET.Element("inertial")
        ET.SubElement(inertial, "mass", {"value": str(FRAME_MASS_KG)})
        tiny = dict.fromkeys(INERTIA, "0") | dict.fromkeys(PRINCIPAL, "1e-9")
        ET.SubElement(inertial, "inertia", tiny)
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
