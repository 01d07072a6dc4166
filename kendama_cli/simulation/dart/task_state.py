"""State of the arm for a task-space controller, and the torques that depend on its motion."""

from __future__ import annotations

from typing import Any

import numpy as np

from kendama_cli.robot_model.joint_torque import TaskState
from kendama_cli.robot_model.model import RobotModel
from kendama_cli.schema.arrays import Array


def task_state(arm: RobotModel, position_rad: Array, velocity_rad_s: Array, felt_n: Array) -> TaskState:
    """Return the arm in that state (n,), with ``felt_n`` (3,), the contact's force as the wrist's sensor reads it."""
    body = arm.posed(position_rad, velocity_rad_s)
    tool, skeleton = body.cup, body.skeleton
    jacobian, rate = skeleton.getWorldJacobian(tool), skeleton.getJacobianClassicDeriv(tool)
    place = tool.getWorldTransform()
    return TaskState(
        position_rad=position_rad,
        velocity_rad_s=velocity_rad_s,
        tool_m=np.array(place.translation()),
        tool_rotation=np.array(place.rotation()),
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
