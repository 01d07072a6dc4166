"""Sensor at the wrist: the wrench between tip link and tool, the force of a contact, and the state of the task."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from kendama_cli.motion.rotation import cross
from kendama_cli.robot_model.body import Body
from kendama_cli.robot_model.joint_torque import TaskState
from kendama_cli.robot_model.model import RobotModel
from kendama_cli.schema.arrays import Array


def wrist_wrench(body: Body, world: Any) -> Array:
    """Return the tool's wrench on the tip link after the last step, in that link's frame at its origin.

    (6,), force [N], then torque [Nm]: the weight of the tool at rest, its inertia in motion, and what touches it. Other
    forces on the tool must be set on its bodies before; all of them are cleared.
    """
    tool = body.cup
    for contact in world.getLastCollisionResult().getContacts():
        if _body_of(contact.collisionObject1) == tool:
            tool.addExtForce(contact.force, contact.point, False, False)
        elif _body_of(contact.collisionObject2) == tool:
            tool.addExtForce(-contact.force, contact.point, False, False)
    body.skeleton.computeInverseDynamics(True, False, False)
    held = np.array(tool.getBodyForce())
    body.skeleton.clearExternalForces()
    rotation, at = body.tool_in_tip.rotation(), body.tool_in_tip.translation()
    force = rotation @ held[3:]
    return -np.concatenate([force, rotation @ held[:3] + cross(at, force)])


class ContactSensor:
    """The force that the tool exerts on other bodies, as it is and as a sensor at the wrist reads it.

    ``contact_n`` (3,) is that of the last step, in the world, ``felt_n`` the reading: the sensor sits before the tool,
    whose weight is taken off, whose inertia is not, and it is of first order. ``touched`` is the body's name or "".
    """

    def __init__(self, tool: Any, mass_kg: float, sensor_hz: float, step_s: float) -> None:
        self._tool = tool
        self._mass_kg = mass_kg
        self._share = 1.0 - math.exp(-2.0 * math.pi * sensor_hz * step_s)
        self.reset()

    def reset(self) -> None:
        """Forget what was felt."""
        self.contact_n: Array = np.zeros(3)
        self.felt_n: Array = np.zeros(3)
        self.touched = ""

    def read(self, world: Any) -> None:
        """Gather what the tool exerted in the last step."""
        force, touched = np.zeros(3), ""
        for contact in world.getLastCollisionResult().getContacts():
            first, second = contact.collisionObject1, contact.collisionObject2
            # DART's force acts on the first of the two
            if _body_of(first) == self._tool:
                force, touched = force - contact.force, _name(second)
            elif _body_of(second) == self._tool:
                force, touched = force + contact.force, _name(first)
        self.contact_n, self.touched = force, touched
        reading = force + self._mass_kg * self._tool.getCOMLinearAcceleration()
        self.felt_n = self.felt_n + self._share * (reading - self.felt_n)


def _body_of(touching: Any) -> Any:
    return touching.getShapeFrame().asShapeNode().getBodyNodePtr()


def _name(touching: Any) -> str:
    return str(touching.getShapeFrame().getName()).removeprefix("scene ")


def task_state(arm: RobotModel, position_rad: Array, velocity_rad_s: Array, felt_n: Array) -> TaskState:
    """Return the arm in that state (n,), with ``felt_n`` (3,), the contact's force as the wrist's sensor reads it."""
    body = arm.posed(position_rad, velocity_rad_s)
    tool, skeleton = body.cup, body.skeleton
    jacobian, rate = skeleton.getWorldJacobian(tool), skeleton.getJacobianClassicDeriv(tool)
    pose = tool.getWorldTransform()
    return TaskState(
        position_rad=position_rad,
        velocity_rad_s=velocity_rad_s,
        tool_m=np.array(pose.translation()),
        tool_rotation=np.array(pose.rotation()),
        jacobian=np.vstack([jacobian[3:], jacobian[:3]]),
        jacobian_rate=np.vstack([rate[3:], rate[:3]]),
        inertia=skeleton.getMassMatrix() + np.diag(arm.rotor_inertia_kg_m2),
        contact_n=felt_n,
    )


def coriolis_nm(skeleton: Any, velocity_rad_s: Array) -> Array:
    """Return C(q, q') v (n,) for any v = ``velocity_rad_s``, C being that of Christoffel's symbols.

    C(q, a) b is symmetric in a and b, and C(q, a) a is what DART knows: C(q, a) b is a quarter of its difference
    at a + b and a - b.
    """
    now = skeleton.getVelocities()
    skeleton.setVelocities(now + velocity_rad_s)
    plus = skeleton.getCoriolisForces()
    skeleton.setVelocities(now - velocity_rad_s)
    minus = skeleton.getCoriolisForces()
    skeleton.setVelocities(now)
    return np.asarray((plus - minus) / 4)
