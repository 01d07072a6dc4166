"""Position servos of ours for the joints of a model whose motors take torques."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Any

import numpy as np

from kendama_cli.plugins.mujoco.arm_joints import ArmJoints
from kendama_cli.plugins.mujoco.library import mujoco
from kendama_cli.schema.arrays import Array

RATE_RAD_S = 2.0 * math.pi * 8.0
"""Undamped rate of a servo: 8 Hz. It follows a steady motion 2 / rate = 40 ms late."""


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
