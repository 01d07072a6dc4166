"""URDF of the arm in a MuJoCo model, for who has no other description of it."""

from __future__ import annotations

import os
import warnings
import xml.etree.ElementTree as ET
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from kendama_cli.errors import InputError
from kendama_cli.plugins.mujoco.library import mujoco
from kendama_cli.schema.arrays import Array

MOUNT = "mount"
"""The link in whose frame the model stands as in its file."""
SITE = "attachment_site"
"""Name of the flange's frame in MuJoCo Menagerie."""


@dataclass(frozen=True)
class ArmUrdf:
    """The ``text`` of the URDF, and each joint's ``rotor_inertia_kg_m2`` by name, which a URDF cannot state."""

    text: str
    rotor_inertia_kg_m2: Mapping[str, float]


def arm_urdf(path: str, name: str) -> ArmUrdf:
    """Return the URDF of the tree of bodies in the MJCF at ``path`` that has the longest chain of hinges.

    Masses, frames, friction and ranges are those that MuJoCo compiles; a joint's range is also that of its actuator's
    command, its effort the least of the limits. An MJCF has no speed limits. Raises InputError where the file is no
    MJCF of an arm, or a body has more than one joint.
    """
    model = compiled(path)
    chain = max((_chain(model, body) for body in range(model.nbody)), key=len)
    if not chain:
        raise _no_chain(path, model)
    root = ET.Element("robot", {"name": name})
    ET.SubElement(root, "link", {"name": MOUNT})
    tree = int(model.body_rootid[chain[-1]])
    for body in range(1, model.nbody):
        if int(model.body_rootid[body]) == tree:
            _add_body(path, model, root, body)
    _add_site(model, root, tree)
    ET.indent(root)
    joints = range(model.njnt)
    armature = {model.joint(one).name: float(model.dof_armature[model.jnt_dofadr[one]]) for one in joints}
    return ArmUrdf(ET.tostring(root, encoding="unicode") + "\n", armature)


def compiled(path: str) -> Any:
    """Return the model of the file; raises InputError where MuJoCo cannot build it."""
    try:
        return mujoco().MjModel.from_xml_path(os.path.abspath(path))  # by a relative one it misses meshes of includes
    except (ValueError, OSError) as error:
        raise InputError(path, f"MuJoCo cannot build it: {' '.join(str(error).split())[:200]}") from None


def _no_chain(path: str, model: Any) -> InputError:
    """Return the refusal of a model without a hinge that only hinges carry."""
    kinds = mujoco().mjtJoint
    if not (model.jnt_type == int(kinds.mjJNT_HINGE)).any():
        return InputError(path, "the model has no joint that turns", remedy="name the model of an arm")
    other = int(np.flatnonzero(model.jnt_type != int(kinds.mjJNT_HINGE))[0])
    name = model.joint(other).name or other
    moves = {int(kinds.mjJNT_SLIDE): "slides", int(kinds.mjJNT_FREE): "floats"}.get(int(model.jnt_type[other]), "rolls")
    return InputError(
        path,
        f"joint '{name}' {moves}, and carries all that turn; allowed: hinges on a fixed base",
        remedy="name a model of the arm alone, or delete that joint in a copy",
    )


def _chain(model: Any, body: int) -> list[int]:
    """Return the bodies with a hinge on the way to ``body``; none where it also slides or floats."""
    found: list[int] = []
    while body:
        if model.body_jntnum[body]:
            if int(model.jnt_type[model.body_jntadr[body]]) != int(mujoco().mjtJoint.mjJNT_HINGE):
                return []
            found.insert(0, body)
        body = int(model.body_parentid[body])
    return found


def _add_body(path: str, model: Any, root: ET.Element, body: int) -> None:
    """Add the link of ``body`` and the joint that holds it; a link's frame is at its joint's anchor."""
    name, count = _name(model, body), int(model.body_jntnum[body])
    if count > 1:
        raise InputError(path, f"body '{name}' has {count} joints; allowed: one", remedy="give each a body of its own")
    link = ET.SubElement(root, "link", {"name": name})
    if (mass := float(model.body_mass[body])) > 0.0:
        inertial = ET.SubElement(link, "inertial")
        turn = _rotation(model.body_iquat[body])
        _set_origin(inertial, model.body_ipos[body] - _anchor(model, body), turn)
        ET.SubElement(inertial, "mass", {"value": _text(mass)})
        moments = dict(zip(("ixx", "iyy", "izz"), map(_text, model.body_inertia[body]), strict=True))
        ET.SubElement(inertial, "inertia", moments | dict.fromkeys(("ixy", "ixz", "iyz"), "0"))
    parent = int(model.body_parentid[body])
    number = int(model.body_jntadr[body])
    joint = ET.SubElement(root, "joint", _kind(model, body, number))
    ET.SubElement(joint, "parent", {"link": _name(model, parent) if parent else MOUNT})
    ET.SubElement(joint, "child", {"link": name})
    turn = _rotation(model.body_quat[body])
    _set_origin(
        joint,
        model.body_pos[body] + turn.apply(_anchor(model, body)) - _anchor(model, parent),
        turn * _from_reference(model, body),
    )
    if count:
        ET.SubElement(joint, "axis", {"xyz": _text(*model.jnt_axis[number])})
        _add_limits(model, joint, number)


def _kind(model: Any, body: int, number: int) -> dict[str, str]:
    if not model.body_jntnum[body]:
        return {"name": f"fixed_{_name(model, body)}", "type": "fixed"}
    kinds = mujoco().mjtJoint
    limited = {int(kinds.mjJNT_HINGE): "revolute", int(kinds.mjJNT_SLIDE): "prismatic"}
    kind = limited.get(int(model.jnt_type[number]), "floating")
    low, high = joint_range(model, number)
    endless = kind == "revolute" and not np.isfinite([low, high]).all()
    return {"name": model.joint(number).name or f"joint{number}", "type": "continuous" if endless else kind}


def joint_range(model: Any, joint: int) -> tuple[float, float]:
    """Return the angles [rad] that a joint reaches: by its own range, and by that of its actuator's command."""
    low, high = (-np.inf, np.inf) if not model.jnt_limited[joint] else map(float, model.jnt_range[joint])
    for actuator in _actuators(model, joint):
        if model.actuator_ctrllimited[actuator] and model.actuator_biasprm[actuator, 1] != 0.0:  # commands are angles
            one, other = sorted(model.actuator_ctrlrange[actuator] / model.actuator_gear[actuator, 0])
            low, high = max(low, float(one)), min(high, float(other))
    return low, high


def _add_limits(model: Any, joint: ET.Element, number: int) -> None:
    low, high = joint_range(model, number)
    limits = {"lower": _text(low), "upper": _text(high)} if np.isfinite([low, high]).all() else {}
    efforts = [float(model.jnt_actfrcrange[number, 1])] if model.jnt_actfrclimited[number] else []
    for actuator in _actuators(model, number):
        gear = abs(float(model.actuator_gear[actuator, 0]))
        if model.actuator_forcelimited[actuator]:
            efforts.append(gear * float(model.actuator_forcerange[actuator, 1]))
        if model.actuator_ctrllimited[actuator] and _is_motor(model, actuator):
            efforts.append(gear * float(model.actuator_gainprm[actuator, 0] * model.actuator_ctrlrange[actuator, 1]))
    limits |= {"effort": _text(min(efforts))} if efforts else {}
    ET.SubElement(joint, "limit", limits)
    moves = int(model.jnt_dofadr[number])
    friction = {"damping": _text(model.dof_damping[moves]), "friction": _text(model.dof_frictionloss[moves])}
    ET.SubElement(joint, "dynamics", friction)


def _is_motor(model: Any, actuator: int) -> bool:
    """Return True if the force of ``actuator`` is its command times a constant."""
    mj = mujoco()
    kinds = (int(mj.mjtGain.mjGAIN_FIXED), int(mj.mjtBias.mjBIAS_NONE))
    return (int(model.actuator_gaintype[actuator]), int(model.actuator_biastype[actuator])) == kinds


def _actuators(model: Any, joint: int) -> list[int]:
    kind = int(mujoco().mjtTrn.mjTRN_JOINT)
    return [k for k in range(model.nu) if model.actuator_trntype[k] == kind and model.actuator_trnid[k, 0] == joint]


def _add_site(model: Any, root: ET.Element, tree: int) -> None:
    """Add the frame of the flange, where the arm has one."""
    for site in range(model.nsite):
        body = int(model.site_bodyid[site])
        if model.body_rootid[body] == tree and model.site(site).name == SITE:
            ET.SubElement(root, "link", {"name": SITE})
            joint = ET.SubElement(root, "joint", {"name": f"fixed_{SITE}", "type": "fixed"})
            ET.SubElement(joint, "parent", {"link": _name(model, body)})
            ET.SubElement(joint, "child", {"link": SITE})
            _set_origin(joint, model.site_pos[site] - _anchor(model, body), _rotation(model.site_quat[site]))


def _name(model: Any, body: int) -> str:
    return str(model.body(body).name or f"body{body}")


def _anchor(model: Any, body: int) -> Array:
    """Return the origin of the link of ``body`` in the body's frame."""
    return np.array(model.jnt_pos[model.body_jntadr[body]]) if body and model.body_jntnum[body] else np.zeros(3)


def _from_reference(model: Any, body: int) -> Rotation:
    """Return the rotation that takes a joint from its reference angle, at which the file draws it, to zero."""
    if not model.body_jntnum[body]:
        return Rotation.identity()
    joint = int(model.body_jntadr[body])
    return Rotation.from_rotvec(-model.qpos0[model.jnt_qposadr[joint]] * model.jnt_axis[joint])


def _rotation(quat: Array) -> Rotation:
    return Rotation.from_quat(np.roll(quat, -1))  # MuJoCo's begins with w


def _set_origin(element: ET.Element, xyz_m: Array, turn: Rotation) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # where two angles turn about one axis, any pair of them will do
        angles = turn.as_euler("xyz")
    ET.SubElement(element, "origin", {"xyz": _text(*xyz_m), "rpy": _text(*angles)})


def _text(*values: float) -> str:
    return " ".join(f"{float(value) + 0.0:.12g}" for value in values)
