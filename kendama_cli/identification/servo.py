"""The arm's own servo, from the commands and encoders of one motion."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.signal import savgol_filter

from kendama_cli.artifacts.servo_model import ServoModel
from kendama_cli.devices.robot.interface import Exchange
from kendama_cli.robot_model.model import RobotModel
from kendama_cli.schema.arrays import Array

WINDOW_S, ORDER = 0.06, 4
"""Window and order of the local polynomials that smooth the encoders and differentiate them."""
MAX_DEAD_TIME_S = 0.04
PARSIMONY = 1.05
"""The shortest dead time is taken whose squared residual is within this factor of the smallest."""
MOVED = 0.05
"""A joint with less than this fraction of the largest squared velocity tells no lag: it takes the others' median."""
STILL_RAD_S = 0.01
"""A joint whose rate stays below this, root mean square, does not move."""
FOLLOWS_RAD = 3e-3
"""Sag and offset below this are left alone: friction in the joints of a wrist looks like them."""
SIGMAS = 1.96
SAME_DELAY_S = 4e-3
"""A change of the delay below this costs no catch: 3 % of the largest lag at which the swing was tried."""


def servo_of(arm: RobotModel, exchanges: Sequence[Exchange], period_s: float) -> ServoModel | None:
    """Return the servo (fit_servo) from what was sent and measured in the control periods of one motion."""
    sent = np.array([one.sent.position_rad for one in exchanges])
    measured = np.array([one.state.position_rad for one in exchanges])
    return fit_servo(arm, sent, measured, period_s)


def servo_changed(before: ServoModel, now: ServoModel) -> bool:
    """Return True if the delays d + T (median of the joints) differ by more than SAME_DELAY_S and their 95 % interval.

    Dead time and lag are compared as a sum: a fit can take a part of one for the other.
    """
    sigma_s = math.hypot(*(float(np.median(one.lag_sigma_s)) for one in (before, now)))
    return abs(now.delay_s - before.delay_s) > max(SAME_DELAY_S, SIGMAS * sigma_s)


def fit_servo(arm: RobotModel, sent_rad: Array, measured_rad: Array, period_s: float) -> ServoModel | None:
    """Return the servo that turned the commands ``sent_rad`` (k, n) into the angles ``measured_rad`` (k, n).

    Per joint, by least squares over all control periods,

        u(t) - q(t + d) = T q'(t + d) + s tau(q, q', q'')(t + d) + c

    with the dead time d, a whole number of periods, common to all joints. The standard deviation of T counts the
    residuals' correlation from period to period. A lag within its 95 % interval of zero, or below half a control
    period, is zero; so are sag and offset where they never come to FOLLOWS_RAD. None where no joint moved, or the
    motion is shorter than the polynomials that smooth it.
    """
    window = 2 * round(WINDOW_S / period_s / 2) + 1
    longest = round(MAX_DEAD_TIME_S / period_s)
    window = max(window, ORDER + 3)
    if len(measured_rad) < 2 * window + longest:
        return None
    motion = _Motion.smoothed(arm, sent_rad, measured_rad, window, period_s)
    moved = motion.moving()
    if not moved.any():
        return None
    fits = [motion.fit(delay, moved) for delay in range(longest + 1)]
    least = min(one.squares for one in fits)
    delay = next(k for k, one in enumerate(fits) if one.squares <= PARSIMONY * least)
    return fits[delay].servo(arm.joint_names, delay * period_s, period_s)


@dataclass(frozen=True)
class _Fit:
    """Coefficients (n,) of one dead time, the sum of ``squares`` of the joints that moved, and the largest sag."""

    squares: float
    lag_s: Array
    lag_sigma_s: Array
    sag_rad_nm: Array
    offset_rad: Array
    max_sag_rad: Array

    def servo(self, names: tuple[str, ...], dead_time_s: float, period_s: float) -> ServoModel:
        """Return the model, its insignificant terms zero."""
        least = np.maximum(SIGMAS * self.lag_sigma_s, 0.5 * period_s)
        lag = np.where(self.lag_s <= least, 0.0, self.lag_s)
        sags = self.max_sag_rad > FOLLOWS_RAD
        none = np.zeros_like(lag)
        return ServoModel(
            names,
            dead_time_s,
            lag,
            self.lag_sigma_s,
            np.where(sags, self.sag_rad_nm, none),
            np.where(sags, self.offset_rad, none),
        )


@dataclass(frozen=True)
class _Motion:
    """Commands, smoothed angles, their rates and the torques of the rigid bodies, (k, n) each."""

    sent: Array
    position: Array
    velocity: Array
    torque_nm: Array
    edge: int

    @staticmethod
    def smoothed(arm: RobotModel, sent: Array, measured: Array, window: int, period_s: float) -> _Motion:
        position, velocity, change = (
            np.asarray(savgol_filter(measured, window, ORDER, deriv=order, delta=period_s, axis=0))
            for order in range(3)
        )
        rows = zip(position, velocity, change, strict=True)
        torque_nm = np.array([arm.rigid_effort_nm(*row) for row in rows])
        return _Motion(sent, position, velocity, torque_nm, window // 2)

    def moving(self) -> np.ndarray:
        """Return a mask (n,) of the joints that moved."""
        squares = (self.velocity**2).mean(axis=0)
        return np.asarray((squares > MOVED * squares.max()) & (squares > STILL_RAD_S**2))

    def fit(self, delay: int, moved: np.ndarray) -> _Fit:
        """Return the coefficients with a dead time of ``delay`` periods."""
        end = len(self.sent) - self.edge
        here, ahead = slice(self.edge, end - delay), slice(self.edge + delay, end)
        behind = self.sent[here] - self.position[ahead]
        velocity, torque = self.velocity[ahead], self.torque_nm[ahead]
        count = moved.size
        lag, sigma, sag, offset, squares = (np.zeros(count) for _ in range(5))
        for j in np.flatnonzero(moved):
            terms = np.column_stack([velocity[:, j], torque[:, j], np.ones(len(behind))])
            (lag[j], sag[j], offset[j]), residual = _least_squares(terms, behind[:, j])
            squares[j] = residual @ residual
            sigma[j] = _deviation(terms, residual)
        lag[~moved], sigma[~moved] = np.median(lag[moved]), np.median(sigma[moved])
        for j in np.flatnonzero(~moved):
            terms = np.column_stack([torque[:, j], np.ones(len(behind))])
            (sag[j], offset[j]), _ = _least_squares(terms, behind[:, j] - lag[j] * velocity[:, j])
        largest = np.abs(torque * sag + offset).max(axis=0)
        return _Fit(float(squares.sum()), lag, sigma, sag, offset, largest)


def cup_sag_m(arm: RobotModel, servo: ServoModel, position_rad: Array) -> float:
    """Return how far the cup rests from where it is commanded at ``position_rad`` (n,), unled."""
    effort_nm = arm.rigid_effort_nm(position_rad, np.zeros_like(position_rad), np.zeros_like(position_rad))
    resting_rad = position_rad - servo.sag_rad_nm * effort_nm - servo.offset_rad
    return float(np.linalg.norm(arm.tool_position_m(resting_rad) - arm.tool_position_m(position_rad)))


def _least_squares(terms: Array, values: Array) -> tuple[Array, Array]:
    """Return coefficients and residual of ``values`` (k,) by ``terms`` (k, m)."""
    found: Array = np.asarray(np.linalg.lstsq(terms, values, rcond=None)[0], dtype=np.float64)
    return found, values - terms @ found


def _deviation(terms: Array, residual: Array) -> float:
    """Return the standard deviation of the first coefficient.

    With the residuals' correlation rho from one period to the next the variance of independent ones is multiplied by
    (1 + rho) / (1 - rho), that of a process of first order.
    """
    square = float(residual @ residual)
    rho = float(residual[1:] @ residual[:-1]) / square if square > 0.0 else 0.0
    inflated = (1.0 + max(rho, 0.0)) / max(1.0 - rho, 1e-3)
    variance = square / (len(residual) - terms.shape[1]) * float(np.linalg.pinv(terms.T @ terms)[0, 0])
    return float(np.sqrt(variance * inflated))
