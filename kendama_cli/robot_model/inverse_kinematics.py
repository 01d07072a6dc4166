"""Joint angles along a path of the cup, upright or tilted."""

from __future__ import annotations

import numpy as np

from kendama_cli.errors import StageError
from kendama_cli.robot_model.model import RobotModel
from kendama_cli.schema.arrays import Array

TOLERANCE = 1e-9
"""Largest error of the solved task in m and rad; Newton's steps reach it in two or three."""

MOST_STEPS = 30
LONGEST_STEP_RAD = 0.2


def weighted_step(jacobian: Array, change: Array, weights: Array, damping: float = 1e-9) -> Array:
    """The joint step (n,) that makes the task ``change`` (t,) with the least weighted sum of squares.

        dq = W^-1 J^T (J W^-1 J^T + damping trace/t)^-1 dx

    J is ``jacobian`` (t, n), W the diagonal of ``weights`` (n,). With the inverse squares of the speed limits as
    weights, a slow joint is spared in favour of a fast one. ``damping``, relative, keeps the step finite where J
    loses rank.
    """
    spread = jacobian / weights
    square = spread @ jacobian.T
    square += np.eye(len(square)) * (damping * np.trace(square) / len(square))
    return np.asarray(spread.T @ np.linalg.solve(square, change))


def solve_upright(arm: RobotModel, cup_m: Array, start_rad: Array, axis: Array | None = None) -> Array:
    """The joint angles (n,), near ``start_rad``, that hold the cup upright with its tie point at ``cup_m`` (3,).

    With ``axis`` (3,), a unit vector, the cup's axis points along it instead. The redundancy goes where
    ``arm.redundancy_weights`` make it cheapest. Raises StageError where the arm cannot reach.
    """
    angles = np.array(start_rad, dtype=np.float64)
    goal = np.concatenate([cup_m, np.zeros(2)])
    miss = np.inf
    for _ in range(MOST_STEPS):
        value, jacobian = arm.upright_task(angles) if axis is None else _tilted_task(arm, angles, axis)
        change = goal - value
        change[3:] = value[3:]  # the value is already the turn that is missing
        miss = float(np.abs(change).max())
        if miss < TOLERANCE:
            return angles
        step = weighted_step(jacobian, change, arm.redundancy_weights)
        angles = angles + step * min(1.0, LONGEST_STEP_RAD / max(float(np.abs(step).max()), 1e-12))
    raise OutOfReachError(arm.settings.name, cup_m, miss)


def _tilted_task(arm: RobotModel, angles: Array, axis: Array) -> tuple[Array, Array]:
    """As ``RobotModel.upright_task`` for a cup whose axis is to point along ``axis``: the missing turn about two
    directions across it, and the Jacobian of place and of turning about these."""
    pose, jacobian = arm.tool_pose(angles), arm.tool_jacobian(angles)
    aside = np.cross(axis, np.eye(3)[int(np.abs(axis).argmin())])
    aside /= np.linalg.norm(aside)
    across = np.array([aside, np.cross(axis, aside)])
    now = pose.rotation[:, 2]
    turn = across @ np.cross(now, axis)
    if now @ axis < 0:  # it points the other way: lengthened to be found
        turn /= max(float(np.linalg.norm(turn)), 1e-9)
    return np.concatenate([pose.position_m, turn]), np.vstack([jacobian[:3], across @ jacobian[3:]])


class OutOfReachError(StageError):
    """The arm cannot hold the cup upright at ``cup_m`` (3,); ``miss`` is how far it stays off [m or rad]."""

    def __init__(self, robot: str, cup_m: Array, miss: float, when: str = "") -> None:
        self.robot, self.cup_m, self.miss = robot, cup_m, miss
        x, y, z = np.round(cup_m, 3).tolist()
        super().__init__(
            f"the arm {robot} cannot hold the cup upright at x {x}, y {y}, z {z} m{when} (it stays {miss:.3g} off): "
            "make the motion smaller or place the arm otherwise (adapt.placement=search, or kendama robot place)"
        )


def follow_path(
    arm: RobotModel, cup_m: Array, start_rad: Array, t_s: Array | None = None, axes: Array | None = None
) -> Array:
    """The joint angles (k, n) along the path ``cup_m`` (k, 3), each found from the one before.

    The cup is upright, or its axis points along ``axes`` (k, 3). Raises StageError where the arm cannot reach or,
    naming the joint and its limit, where a position limit stands in the way; the instant is named where ``t_s`` (k,)
    is given.
    """
    angles = np.empty((len(cup_m), len(start_rad)))
    last = start_rad
    for i, place in enumerate(cup_m):
        try:
            last = angles[i] = solve_upright(arm, place, last, None if axes is None else axes[i])
        except OutOfReachError as error:
            raise OutOfReachError(error.robot, error.cup_m, error.miss, _when(t_s, i)) from None
    outside = (angles < arm.limits.lower_rad) | (angles > arm.limits.upper_rad)
    if outside.any():
        k, j = (int(v) for v in np.argwhere(outside)[0])
        low, high = arm.limits.lower_rad[j], arm.limits.upper_rad[j]
        raise StageError(
            f"joint '{arm.joint_names[j]}' of {arm.settings.name} would need {angles[k, j]:.3f} rad{_when(t_s, k)}; "
            f"allowed: {low:.3f} to {high:.3f} rad: make the motion smaller or place the arm otherwise "
            "(adapt.placement=search, or kendama robot place)"
        )
    return angles


def _when(t_s: Array | None, sample: int) -> str:
    return "" if t_s is None else f" at {t_s[sample]:.2f} s"
