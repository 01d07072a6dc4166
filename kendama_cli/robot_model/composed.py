"""A composed DART skeleton held against another reading of its URDF, so that no library changes an arm unseen."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from kendama_cli.errors import InputError
from kendama_cli.robot_model.description import Description, dart_name
from kendama_cli.robot_model.urdf_tree import UrdfTree, end, numbers
from kendama_cli.schema.arrays import Array

POSITIONS = 50
MOST_GAP = 1e-9
"""Metres, entries of a rotation, kilograms and kg m^2 by which both may differ."""
REMEDY = "please report this file as a bug; rename the link meanwhile"
LEAST_INERTIA_KG_M2 = 1e-9
"""A joint that turns less than this has no acceleration that could be computed."""


def check_composed(description: Description, skeleton: Any, rotor_inertia_kg_m2: Array) -> None:
    """Compare every link of ``skeleton`` with the file at POSITIONS random joint positions: pose, mass, inertia.

    Raises InputError where one differs by more than MOST_GAP, or where a joint would turn nothing that has inertia.
    """
    lower, upper = (np.array(description.limits[key]) for key in ("lower_rad", "upper_rad"))
    spread = np.random.default_rng(0).random((POSITIONS, len(lower)))
    positions = np.maximum(lower, -np.pi) + spread * (np.minimum(upper, np.pi) - np.maximum(lower, -np.pi))
    poses = link_poses(description.tree, description.joint_names, positions)
    bodies = {name: skeleton.getBodyNode(dart_name(name)) for name in poses}
    if gone := [name for name, body in bodies.items() if body is None]:
        raise InputError(description.path, f"link '{gone[0]}' is not in what DART makes of it", remedy=REMEDY)
    base = bodies[description.tree.root].getWorldTransform().inverse()
    worst, of, inertias = 0.0, "", np.zeros((POSITIONS, len(lower), len(lower)))
    for k, position in enumerate(positions):
        skeleton.setPositions(position)
        for name, (rotation, place) in poses.items():
            found = base.multiply(bodies[name].getWorldTransform())
            gap = max(np.abs(found.rotation() - rotation[k]).max(), np.abs(found.translation() - place[k]).max())
            if gap > worst:
                worst, of = float(gap), f"the pose of link '{name}'"
        inertias[k] = skeleton.getMassMatrix()
    smallest, directions = np.linalg.eigh(inertias + np.diag(rotor_inertia_kg_m2))
    if smallest[:, 0].min() < LEAST_INERTIA_KG_M2:
        k = int(smallest[:, 0].argmin())
        joint = description.joint_names[int(np.abs(directions[k, :, 0]).argmax())]
        problem = f"joint '{joint}' moves nothing that has inertia ({smallest[k, 0]:.1e} kg m^2)"
        raise InputError(description.path, problem, remedy="check the <inertial> of the links that it moves")
    for name, link in description.tree.links.items():
        gap = _inertia_gap(bodies[name].getInertia(), link if name not in description.massless else None)
        if gap > worst:
            worst, of = gap, f"the inertia of link '{name}'"
    if worst > MOST_GAP:
        problem = f"{of} differs by {worst:.1e} between the file and what DART makes of it"
        raise InputError(
            description.path, problem, remedy="please report this file as a bug; rename the link meanwhile"
        )


def link_poses(tree: UrdfTree, joint_names: tuple[str, ...], positions_rad: Array) -> dict[str, tuple[Array, Array]]:
    """Return every link's rotation (k, 3, 3) and place (k, 3) [m] in the root link's frame, from the file alone.

        T_child = T_parent  Trans(xyz) Rz(yaw) Ry(pitch) Rx(roll)  Rot(axis, q)

    ``positions_rad`` (k, n) are those of ``joint_names``, in their order; other joints stay at zero.
    """
    count = len(positions_rad)
    poses = {tree.root: (np.broadcast_to(np.eye(3), (count, 3, 3)), np.zeros((count, 3)))}
    for name in sorted(tree.links, key=lambda link: len(tree.chain(link))):
        joint = tree.parents.get(name)
        if joint is None:
            continue
        rotation, position = poses[end(joint, "parent")]
        turn, shift = _origin(joint)
        position, rotation = position + rotation @ shift, rotation @ turn
        if joint.get("name") in joint_names:
            axis = np.array(numbers(joint.find("axis"), "xyz", (1.0, 0.0, 0.0)))
            angle = positions_rad[:, joint_names.index(joint.get("name", ""))]
            rotation = rotation @ Rotation.from_rotvec(np.outer(angle, axis / np.linalg.norm(axis))).as_matrix()
        poses[name] = rotation, position
    return poses


def _origin(element: Any) -> tuple[Array, Array]:
    """Return the rotation (3, 3) and position (3,) of the element's <origin>."""
    origin = element.find("origin")
    rotation = Rotation.from_euler("xyz", numbers(origin, "rpy", (0.0, 0.0, 0.0))).as_matrix()
    return rotation, np.array(numbers(origin, "xyz", (0.0, 0.0, 0.0)))


def _inertia_gap(found: Any, link: Any) -> float:
    """Return the maximum difference of mass, mass times centre, and inertia about the link's origin; all are linear."""
    mass, center, moment = 0.0, np.zeros(3), np.zeros((3, 3))
    if link is not None:
        inertial = link.find("inertial")
        rotation, center = _origin(inertial)
        mass = numbers(inertial.find("mass"), "value", (0.0,))[0]
        names = (("ixx", "ixy", "ixz"), ("ixy", "iyy", "iyz"), ("ixz", "iyz", "izz"))
        own = np.array([[numbers(inertial.find("inertia"), name, (0.0,))[0] for name in row] for row in names])
        moment = rotation @ own @ rotation.T
    gaps = (found.getMass() - mass, mass * (np.array(found.getLocalCOM()) - center), found.getMoment() - moment)
    return float(max(np.abs(gap).max() for gap in gaps))
