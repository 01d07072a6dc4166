"""Joints and actuators of a MuJoCo model that are those of the arm; servos of ours where its motors take torques."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np

from kendama_cli.errors import InputError
from kendama_cli.plugins.mujoco.library import mujoco
from kendama_cli.schema.arrays import Array

RATE_RAD_S = 2.0 * math.pi * 8.0
"""Undamped rate of a servo: 8 Hz. It follows a steady motion 2 / rate = 40 ms late."""


@dataclass(frozen=True)
class ArmJoints:
    """The arm's n joints in a compiled model, in the order of its URDF.

    ``joint``, ``position`` and ``velocity`` (n,) are indices of joints and into ``qpos`` and ``qvel``; ``actuator``
    (n,) are the servos, whose command is ``gear`` (n,) times a joint's angle. ``body`` is the last joint's body.
    """

    joint: Array
    position: Array
    velocity: Array
    actuator: Array
    gear: Array
    body: int


def find_joints(path: str, model: Any, names: tuple[str, ...]) -> ArmJoints:
    """Find the joints called ``names``, else as many hinges with actuators in the model's order, and their servos.

    Raises InputError where the model has no actuators or no such joints, where they are no chain, or where one is not
    moved by one position servo.
    """
    mj = mujoco()
    if model.nu == 0:
        raise InputError(path, "the model has no actuators, so that nothing moves it", remedy="name one that has some")
    joints = _matched(path, model, names)
    chain = _chain(model, int(model.jnt_bodyid[joints[-1]]))
    if set(chain) != set(joints):
        odd = model.joint(min(set(chain) ^ set(joints))).name
        raise InputError(
            path,
            f"joint '{odd}' makes the model another chain than that of the robot's joints {', '.join(names)}",
            remedy="name a model of the arm alone, on a fixed base",
        )
    if any(model.jnt_type[joint] != int(mj.mjtJoint.mjJNT_HINGE) for joint in joints):
        raise InputError(path, "the model is not an arm of hinges", remedy="name a model whose joints all turn")
    servos = [_servo(path, model, joint) for joint in joints]
    index = np.array(joints)
    return ArmJoints(
        index,
        model.jnt_qposadr[index].copy(),
        model.jnt_dofadr[index].copy(),
        np.array(servos),
        model.actuator_gear[servos, 0].copy(),
        int(model.jnt_bodyid[joints[-1]]),
    )


def _matched(path: str, model: Any, names: tuple[str, ...]) -> list[int]:
    mj = mujoco()
    there = {model.joint(number).name: number for number in range(model.njnt)}
    if all(name in there for name in names):
        return [there[name] for name in names]
    moved = [int(model.actuator_trnid[number, 0]) for number in range(model.nu) if _turns(model, number)]
    hinges = [joint for joint in sorted(set(moved)) if model.jnt_type[joint] == int(mj.mjtJoint.mjJNT_HINGE)]
    if len(hinges) != len(names):
        raise InputError(
            path,
            f"its {len(hinges)} joints with actuators ({', '.join(model.joint(one).name for one in hinges)}) do not "
            f"match the robot's {len(names)} ({', '.join(names)})",
            remedy="choose the model of the arm that 'robot' describes",
        )
    return hinges


def _turns(model: Any, actuator: int) -> bool:
    kinds = mujoco().mjtTrn
    return int(model.actuator_trntype[actuator]) in (int(kinds.mjTRN_JOINT), int(kinds.mjTRN_JOINTINPARENT))


def _chain(model: Any, body: int) -> list[int]:
    """Return the joints that move ``body``."""
    found: list[int] = []
    while body != 0:
        first = int(model.body_jntadr[body])
        found += range(first, first + int(model.body_jntnum[body]))
        body = int(model.body_parentid[body])
    return found


def _servo(path: str, model: Any, joint: int) -> int:
    """Return the one position servo of ``joint``: force = kp (ctrl - gear q) - kv v, directly or through a filter."""
    mj, name = mujoco(), model.joint(joint).name
    moving = [one for one in range(model.nu) if _turns(model, one) and model.actuator_trnid[one, 0] == joint]
    if len(moving) != 1:
        raise InputError(path, f"joint '{name}' has {len(moving)} actuators; allowed: one position servo")
    (servo,) = moving
    stiffness = float(model.actuator_gainprm[servo, 0])
    follows = stiffness > 0 and abs(model.actuator_biasprm[servo, 1] + stiffness) <= 1e-6 * stiffness
    affine = model.actuator_biastype[servo] == int(mj.mjtBias.mjBIAS_AFFINE)
    dynamics = (mj.mjtDyn.mjDYN_NONE, mj.mjtDyn.mjDYN_FILTER, mj.mjtDyn.mjDYN_FILTEREXACT)
    direct = int(model.actuator_dyntype[servo]) in map(int, dynamics)
    if not (follows and affine and direct):
        raise InputError(
            path,
            f"the actuator of joint '{name}' takes no position",
            remedy="give every joint a position servo (<position>, or <general> with biastype affine)",
        )
    return int(servo)


def add_servos(spec: Any) -> list[str]:
    """Make each motor of ``spec`` that turns one joint a servo within the motor's torques, and compensate gravity.

    Returns the names of these joints; ``tune_servos`` gives the servos their gains.
    """
    mj, turned = mujoco(), []
    for motor in spec.actuators:
        if motor.trntype not in (mj.mjtTrn.mjTRN_JOINT, mj.mjtTrn.mjTRN_JOINTINPARENT):
            continue
        ends = np.sort(motor.gainprm[0] * motor.gear[0] * np.array(motor.ctrlrange))
        if ends[0] < ends[1]:
            motor.forcerange, motor.forcelimited = ends, True
        motor.ctrllimited, motor.gear = False, [1.0, *[0.0] * 5]
        motor.gainprm[0], motor.biasprm[:2], motor.biastype = 1.0, [0.0, -1.0], mj.mjtBias.mjBIAS_AFFINE
        spec.joint(motor.target).actgravcomp = True
        turned.append(motor.target)
    for body in spec.bodies:
        body.gravcomp = 1.0
    return turned


def tune_servos(model: Any, joints: ArmJoints, turned: Iterable[str], positions_rad: Array) -> None:
    """Give the servos of the joints called ``turned`` their gains, critically damped at RATE_RAD_S:

        force = M w^2 (u - q) - 2 M w q',  w = RATE_RAD_S,

    with the joint's largest inertia M at the angles ``positions_rad`` (k, n).
    """
    mj, data, product = mujoco(), mujoco().MjData(model), np.zeros(model.nv)
    for joint, moves, servo in zip(joints.joint, joints.velocity, joints.actuator, strict=True):
        if model.joint(int(joint)).name not in turned:
            continue
        unit, inertia = np.eye(model.nv)[moves], 0.0
        for position_rad in positions_rad:
            data.qpos[joints.position] = position_rad
            mj.mj_forward(model, data)
            mj.mj_mulM(model, data, product, unit)
            inertia = max(inertia, float(product[moves]))
        model.actuator_gainprm[servo, 0] = stiffness = inertia * RATE_RAD_S**2
        model.actuator_biasprm[servo, 1:3] = -stiffness, -2.0 * stiffness / RATE_RAD_S
