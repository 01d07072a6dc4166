"""Tracking delay of joints: the delay of each behind the sent motion, and the residual that no delay explains."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]
LONGEST_S = 0.15
LEAST_RAD = 2e-3
"""A joint whose commands spread less (standard deviation) tells no delay: ten times an encoder's noise."""


@dataclass(frozen=True)
class Tracking:
    """Tracking of n joints, every array (n,): the delay [s] (nan for a joint that hardly moved), rms and maximum of
    measured
    minus sent [rad], and the residual rms if the sent motion is shifted by the delay.
    """

    delay_s: Array
    rms_rad: Array
    largest_rad: Array
    residual_rms_rad: Array


def tracking(t_s: Array, sent_rad: Array, measured_rad: Array) -> Tracking:
    """Return the delay d of each joint that minimises the mean square of measured(t) - sent(t - d), for d in [0,
    LONGEST_S].

    ``t_s`` (k,) are the ends of control periods, the angles (k, n); a gap in time parts two motions, and no delay
    reaches over it. Whole periods are tried, and a parabola through the best and its neighbours tells the rest.
    """
    tracking_error = measured_rad - sent_rad
    steps = np.diff(t_s)
    period_s = float(np.median(steps))
    motion = np.concatenate([[0], np.cumsum(steps > 1.5 * period_s)])
    shifts = min(int(LONGEST_S / period_s) + 1, len(t_s) - 1)
    squares = np.full((shifts + 1, sent_rad.shape[1]), np.inf)
    for shift in range(shifts + 1):
        end = len(t_s) - shift
        whole = motion[shift:] == motion[:end]
        if whole.sum() >= len(t_s) // 2:
            squares[shift] = ((measured_rad[shift:] - sent_rad[:end])[whole] ** 2).mean(axis=0)
    best = [_lowest(column) for column in squares.T]
    moved = sent_rad.std(axis=0) >= LEAST_RAD
    return Tracking(
        delay_s=np.where(moved, [period_s * shift for shift, _ in best], np.nan),
        rms_rad=np.sqrt((tracking_error**2).mean(axis=0)),
        largest_rad=np.abs(tracking_error).max(axis=0),
        residual_rms_rad=np.sqrt([square for _, square in best]),
    )


def _lowest(squares: Array) -> tuple[float, float]:
    """Return the position, in steps, and the value of the minimum of the curve (m,)."""
    k = int(squares.argmin())
    if not 0 < k < len(squares) - 1 or not np.isfinite(squares[k + 1]):
        return float(k), float(squares[k])
    before, at, after = squares[k - 1 : k + 2]
    curve = before - 2 * at + after
    if curve <= 0:
        return float(k), float(at)
    shift = (before - after) / (2 * curve)
    return k + shift, float(max(at - curve * shift**2 / 2, 0.0))
