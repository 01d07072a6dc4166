"""Joints and actuators of a MuJoCo model that are those of the arm."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from kendama_cli.errors import InputError
from kendama_cli.plugins.mujoco.library import mujoco
from kendama_cli.schema.arrays import Array


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
