"""Poses of a robot's hand, a row for each image of a board that it holds."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from kendama_cli.errors import InputError
from kendama_cli.motion.rotation import matrix_of
from kendama_cli.plugins.calibration.csv_rows import csv_rows
from kendama_cli.plugins.calibration.hand_eye import EndEffectorPose
from kendama_cli.robot_model.model import RobotModel
from kendama_cli.schema.arrays import NotUnitError, unit_quaternions

PLACE = ("x_m", "y_m", "z_m")
TURN = ("qw", "qx", "qy", "qz")


def read_hand_poses(path: Path, arm: RobotModel | None, link: str | None = None) -> dict[str, EndEffectorPose]:
    """Read the hand's poses in the robot's world, by the column ``view``: the name of an image, without its ending.

    The other columns are the joints' angles [rad], by the joints' names, where there is an ``arm``; else x_m, y_m, z_m,
    qw, qx, qy, qz. With ``link`` the pose of this link takes the hand's place. Raises InputError for a file that has
    them not, ConfigError for no link of the arm.
    """
    columns = (*PLACE, *TURN) if arm is None else arm.joint_names
    made: dict[str, EndEffectorPose] = {}
    for number, row in enumerate(csv_rows(path, _remedy(columns)), start=2):
        try:
            values = np.array([float(row[name]) for name in columns])
            name = row["view"]
        except (KeyError, TypeError, ValueError):
            values, name = np.array([np.nan]), ""
        if not np.isfinite(values).all() or not name:
            raise InputError(str(path), f"line {number} is no pose of the hand", remedy=_remedy(columns))
        if name in made:
            raise InputError(str(path), f"line {number} gives '{name}' again", remedy="one line for each image")
        made[name] = _of_joints(arm, values, link) if arm is not None else _of_place(path, number, values)
    return made


def _of_joints(arm: RobotModel, angles: np.ndarray, link: str | None) -> EndEffectorPose:
    pose = arm.tool_pose(angles) if link is None else arm.link_pose(link, angles)
    return EndEffectorPose(pose.position_m, pose.rotation)


def _of_place(path: Path, number: int, values: np.ndarray) -> EndEffectorPose:
    try:
        return EndEffectorPose(values[:3], matrix_of(unit_quaternions(values[3:])))
    except NotUnitError as wrong:
        raise InputError(str(path), f"line {number}: {wrong}", remedy="write unit quaternions") from None


def _remedy(columns: tuple[str, ...]) -> str:
    return f"write CSV with the columns view,{','.join(columns)}"


def matching(poses: Mapping[str, EndEffectorPose], views: set[str], path: Path) -> None:
    """Raise InputError where no image has a pose, naming one of each."""
    if not views & set(poses):
        shown = f"the images are '{min(views, default='')}' ..., the poses '{min(poses, default='')}' ..."
        raise InputError(str(path), f"no image has a pose: {shown}", remedy="name each pose after its image")
