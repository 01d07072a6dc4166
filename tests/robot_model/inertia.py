"""The joints' inertia, from what the model says of torques."""

from __future__ import annotations

import numpy as np

from kendama_cli.robot_model.model import RobotModel
from kendama_cli.schema.arrays import Array


def inertia_of(arm: RobotModel, position_rad: Array) -> Array:
    """H (n, n) [kg m^2] of H q'' + C q' + g: what a unit acceleration of each joint adds to the torques."""
    still = np.zeros(len(position_rad))
    held = arm.rigid_effort_nm(position_rad, still, still)
    return np.array([arm.rigid_effort_nm(position_rad, still, unit) - held for unit in np.eye(len(position_rad))])
