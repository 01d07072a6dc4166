"""An arm whose friction has been identified, for simulations of it."""

from __future__ import annotations

import dataclasses

import numpy as np

from kendama_cli.artifacts.friction_model import FrictionModel
from kendama_cli.settings.robot import RobotSettings


def with_identified(robot: RobotSettings, friction: FrictionModel | None) -> RobotSettings:
    """Return ``robot`` with the identified friction in its joints and its controller; unchanged without one.

    The parametric model serves, also where the network is better: simulated joints have Coulomb, Stribeck and viscous
    friction. No term becomes negative; where both have a Stribeck term, the stronger one's speed holds for the sum.
    """
    if friction is None:
        return robot
    found = friction.parametric
    nothing = np.zeros(len(friction.joint_names))
    known = nothing if robot.stribeck_nm is None else np.array(robot.stribeck_nm)
    speed = found.stribeck_rad_s
    if robot.stribeck_rad_s is not None:
        speed = np.where(np.abs(found.stribeck_nm) > known, speed, robot.stribeck_rad_s)

    def together(given: tuple[float, ...] | None, more: np.ndarray) -> tuple[float, ...]:
        total = np.maximum((nothing if given is None else np.array(given)) + more, 0.0)
        return tuple(total.tolist())

    return dataclasses.replace(
        robot,
        coulomb_nm=together(robot.coulomb_nm, found.coulomb_nm),
        viscous_nm_s=together(robot.viscous_nm_s, found.viscous_nm_s),
        stribeck_nm=together(robot.stribeck_nm, found.stribeck_nm),
        stribeck_rad_s=tuple(speed.tolist()),
    )
