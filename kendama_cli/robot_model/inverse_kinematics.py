"""Joint angles for places of the cup, upright or tilted, and along a path of it."""

from __future__ import annotations

import numpy as np

from kendama_cli.errors import StageError
from kendama_cli.robot_model.model import UPRIGHT, RobotModel
from kendama_cli.schema.arrays import Array

TOLERANCE = 1e-9
"""Largest error of the solved task in m and rad; Newton's steps reach it in two or three."""

MOST_STEPS = 30
LONGEST_STEP_RAD = 0.2


def weighted_step(jacobian: Array, change: Array, weights: Array, damping: float = 1e-9) -> Array:
    """Return the joint step (n,) that makes the task ``change`` (t,) with the minimum weighted sum of squares.

        dq = W^-1 J^T (J W^-1 J^T + damping trace/t)^-1 dx

    J is ``jacobian`` (t, n), W the diagonal of ``weights`` (n,). With the inverse squares of the speed limits as
    weights, a slow joint is spared in favour of a fast one. ``damping``, relative, keeps the step finite where J
    loses rank.
    """
    spread = jacobian / weights
    square = spread @ jacobian.T
    square += np.eye(len(square)) * (damping * np.trace(square) / len(square))
    return np.asarray(spread.T @ np.linalg.solve(square, change))


def solve_cup(arm: RobotModel, cup_m: Array, start_rad: Array, about: Array = UPRIGHT) -> Array:
    """Return the joint angles (n,), near ``start_rad``, that hold the cup's tie point at ``cup_m`` (3,), the cup
    upright.

    With ``about`` (2, 3) it points where RobotModel.cup_task says instead. The redundancy goes where
    ``arm.redundancy_weights`` make it cheapest. Raises StageError where the arm cannot reach.
    """
    angles = np.array(start_rad, dtype=np.float64)
    goal = np.concatenate([cup_m, np.zeros(2)])
    miss = np.inf
    for _ in range(MOST_STEPS):
        value, jacobian = arm.cup_task(angles, about)
        change = goal - value
        change[3:] = value[3:]  # the value is already the turn that is missing
        miss = float(np.abs(change).max())
        if miss < TOLERANCE:
            return angles
        step = weighted_step(jacobian, change, arm.redundancy_weights)
        angles = angles + step * min(1.0, LONGEST_STEP_RAD / max(float(np.abs(step).max()), 1e-12))
    raise OutOfReachError(arm.settings.name, cup_m, miss)


def across(axis: Array) -> Array:
    """Return two orthonormal directions (2, 3) perpendicular to ``axis`` (3,), a unit vector that is their cross
    product.
    """
    lateral = np.cross(axis, np.eye(3)[int(np.abs(axis).argmin())])
    lateral /= np.linalg.norm(lateral)
    return np.array([lateral, np.cross(axis, lateral)])


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
    """Return the joint angles (k, n) along the path ``cup_m`` (k, 3), each found from the one before.

    The cup is upright, or its axis points along ``axes`` (k, 3). Raises StageError where the arm cannot reach or,
    naming the joint and its limit, where a position limit forbids it; the instant is named where ``t_s`` (k,)
    is given.
    """
    angles = np.empty((len(cup_m), len(start_rad)))
    last = start_rad
    for i, position in enumerate(cup_m):
        try:
            last = angles[i] = solve_cup(arm, position, last, UPRIGHT if axes is None else across(axes[i]))
        except OutOfReachError as error:
            raise OutOfReachError(error.robot, error.cup_m, error.miss, _when(t_s, i)) from None
    outside = arm.limits.to_stop_rad(angles) < 0
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
