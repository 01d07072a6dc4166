"""Place of a MuJoCo arm in our world: its joints' axes laid upon those of the robot's URDF."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from kendama_cli.robot_model.model import RobotModel
from kendama_cli.schema.arrays import Array


class Pose(NamedTuple):
    """Rotation (3, 3) and position (3,) [m] of a frame in another."""

    rotation: Array
    position_m: Array

    def __matmul__(self, other: Pose) -> Pose:
        """Return the pose in our outer frame of what has ``other`` in this one."""
        return Pose(self.rotation @ other.rotation, self.rotation @ other.position_m + self.position_m)

    def inverse(self) -> Pose:
        """Return the pose of the outer frame in this one."""
        return Pose(self.rotation.T, -self.rotation.T @ self.position_m)


def joint_axes(arm: RobotModel, position_rad: Array) -> tuple[Array, Array]:
    """Return a point (n, 3) [m] on each joint's axis and its direction (n, 3) in the world, at angles (n,).

    A column (v, w) of the Jacobian is v = w x (tie - p): p = tie + w x v is on the axis.
    """
    jacobian = arm.tool_jacobian(position_rad)
    speed, axes = jacobian[:3].T, jacobian[3:].T
    return arm.tool_position_m(position_rad) + np.cross(axes, speed), axes


def laid_upon(points_m: Array, axes: Array, onto_m: Array, onto_axes: Array) -> Pose:
    """Return the pose that lays lines (n, 3) upon others, in the sense of least squares.

    The rotation R maximises sum b.(R a) (Kabsch 1976, https://doi.org/10.1107/S0567739476001873), then t minimises the
    distances (1 - b b^T)(R p + t - q) of the points from the other lines.
    """
    u, _, vt = np.linalg.svd(onto_axes.T @ axes)
    rotation = u @ np.diag([1.0, 1.0, np.linalg.det(u @ vt)]) @ vt
    across = np.eye(3) - onto_axes[:, :, None] * onto_axes[:, None, :]
    apart = np.einsum("nij,nj->ni", across, onto_m - points_m @ rotation.T)
    moved, *_ = np.linalg.lstsq(across.reshape(-1, 3), apart.ravel(), rcond=None)
    return Pose(rotation, moved)


def mean_pose(poses: list[Pose]) -> Pose:
    """Return the rotation nearest to all, in the sense of least squares, and the mean position."""
    u, _, vt = np.linalg.svd(sum(pose.rotation for pose in poses))
    rotation = u @ np.diag([1.0, 1.0, np.linalg.det(u @ vt)]) @ vt
    return Pose(rotation, np.mean([pose.position_m for pose in poses], axis=0))
