"""The arm of DART as the compiled chain on which placements are searched."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from kendama_cli.robot_model.chain_kernel import Chain
from kendama_cli.robot_model.model import RobotModel
from kendama_cli.schema.arrays import Array


def compiled_chain(arm: RobotModel, *, with_tool: bool = False) -> Chain:
    """Return axes, positions and inertias of ``arm``, without the tool on its tip link unless ``with_tool`` is set."""
    body = arm.new_body()
    skeleton = body.skeleton
    n = len(arm.joint_names)
    skeleton.setPositions(np.zeros(n))
    root = skeleton.getBodyNode(0).getWorldTransform()
    rotation, position = np.array(root.rotation()), np.array(root.translation())
    axes, origins = np.zeros((n, 3)), np.zeros((n, 3))
    lumps = [_Lump(0.0, np.zeros(3), np.zeros((3, 3)))] * n
    for i, joint in enumerate(body.joints):
        frame = joint.getChildBodyNode().getWorldTransform().multiply(joint.getTransformFromChildBodyNode())
        axes[i] = rotation.T @ frame.rotation() @ np.array(joint.getAxis())
        origins[i] = rotation.T @ (np.array(frame.translation()) - position)
    names = list(arm.joint_names)
    for number in range(skeleton.getNumBodyNodes()):
        link = skeleton.getBodyNode(number)
        mover = link.getParentJoint()
        while mover is not None and mover.getName() not in names:
            parent = mover.getParentBodyNode()
            mover = None if parent is None else parent.getParentJoint()
        if mover is None or (not with_tool and link.getName() in (body.cup.getName(), body.tie.getName())):
            continue
        i = names.index(mover.getName())
        own = link.getInertia()
        axes_of_link = rotation.T @ np.array(link.getWorldTransform().rotation())
        center = rotation.T @ (np.array(link.getCOM()) - position)
        moment = axes_of_link @ np.array(own.getMoment()) @ axes_of_link.T
        lumps[i] = _joined(lumps[i], _Lump(own.getMass(), center, moment))
    tip = body.tip.getWorldTransform()
    tip_m, tip_turn = rotation.T @ (np.array(tip.translation()) - position), rotation.T @ np.array(tip.rotation())
    return Chain(
        axes,
        origins,
        tip_m,
        tip_turn,
        np.array([lump.mass_kg for lump in lumps]),
        np.array([lump.center_m for lump in lumps]),
        np.array([lump.inertia_kg_m2 for lump in lumps]),
        arm.rotor_inertia_kg_m2,
        arm.friction.viscous_nm_s,
        arm.friction.coulomb_nm,
        arm.friction.stribeck_nm,
        arm.friction.stribeck_rad_s,
        arm.gravity_m_s2,
    )


class _Lump(NamedTuple):
    """A rigid body: mass, centre (3,), and inertia about it (3, 3)."""

    mass_kg: float
    center_m: Array
    inertia_kg_m2: Array


def _joined(one: _Lump, other: _Lump) -> _Lump:
    """Return two bodies that move as one, joined."""
    total = one.mass_kg + other.mass_kg
    center = (one.mass_kg * one.center_m + other.mass_kg * other.center_m) / total
    inertia = np.zeros((3, 3))
    for part in (one, other):
        out = part.center_m - center
        inertia += part.inertia_kg_m2 + part.mass_kg * ((out @ out) * np.eye(3) - np.outer(out, out))
    return _Lump(total, center, inertia)
