"""The arm's own servo, from the commands and encoders of one motion."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.signal import lfilter, savgol_filter

from kendama_cli.artifacts.motion_plan import JointTrajectory
from kendama_cli.artifacts.servo_model import ServoModel
from kendama_cli.devices.robot.interface import Exchange
from kendama_cli.motion.sampling import columns_at
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

    Per joint, over all control periods,

        u(t) - q(t + d) = T q'(t + d) + s tau(q, q', q'')(t + d) + c

    with the dead time d, common to all joints. Least squares find d in whole periods. They shrink T and above all s, as
    the encoders' noise, differentiated, is in the terms (errors in variables). So the rest is found by instrumental
    variables (Reiersol 1945): the same terms of the motion that the commands make of a lag alone, in which no noise is.
    Where a command is held for the period that ends at t, d is minus half a period; it is never less.

    The standard deviation of T counts the residuals' correlation from period to period. A delay within its 95 %
    interval of zero, or below half a control period, is zero; so are sag and offset where they never come to
    FOLLOWS_RAD, or rise under a load. None where no joint moved, or the motion is shorter than the polynomials that
    smooth it.
    """
    window = 2 * round(WINDOW_S / period_s / 2) + 1
    longest = round(MAX_DEAD_TIME_S / period_s)
    window = max(window, ORDER + 3)
    if len(measured_rad) < 2 * window + longest:
        return None
    motion = _Motion.smoothed(arm, measured_rad, window, period_s)
    moved = motion.moving()
    if not moved.any():
        return None
    start, end = window // 2, len(sent_rad) - window // 2
    late = [motion.rows(start + delay, end) for delay in range(longest + 1)]
    fits = [_Fit.of(sent_rad[start : end - delay], one, one, moved) for delay, one in enumerate(late)]
    least = min(one.squares for one in fits)
    delay = next(k for k, one in enumerate(fits) if one.squares <= PARSIMONY * least)
    rough = fits[delay].servo(arm.joint_names, delay * period_s, period_s)
    if rough.follows:
        return rough
    sent, ahead = sent_rad[start : end - delay], late[delay]
    noiseless = _Motion.smoothed(arm, _lagged(sent_rad, fits[delay].lag_s, period_s), window, period_s)
    pure = noiseless.rows(start, end - delay)
    rest_s = max(_rest_s(sent, ahead, pure, moved), -(delay + 0.5) * period_s)
    fit = _Fit.of(sent, ahead.after(rest_s), pure.after(rest_s), moved)
    return fit.servo(arm.joint_names, delay * period_s + rest_s, period_s)


def followed(arm: RobotModel, joints: JointTrajectory, servo: ServoModel) -> JointTrajectory:
    """Return the motion that ``arm`` with this ``servo`` makes of the commands ``joints``, evenly spaced in time."""
    commands = (joints.position_rad, joints.velocity_rad_s, joints.acceleration_rad_s2)
    effort_nm = np.array([arm.rigid_effort_nm(*row) for row in zip(*commands, strict=True)])
    period_s = float(joints.t_s[1] - joints.t_s[0])
    angles = _lagged(joints.position_rad - servo.sag_rad_nm * effort_nm - servo.offset_rad, servo.lag_s, period_s)
    position = columns_at(joints.t_s - servo.dead_time_s, joints.t_s, angles)
    velocity = np.gradient(position, period_s, axis=0)
    return JointTrajectory(joints.joint_names, joints.t_s, position, velocity, np.gradient(velocity, period_s, axis=0))


def _lagged(sent: Array, lag_s: Array, period_s: float) -> Array:
    """Return what a lag of first order makes of the commands ``sent`` (k, n), each held for a period."""
    columns = []
    for column, lag in zip(sent.T, lag_s, strict=True):
        kept = math.exp(-period_s / lag) if lag > 0.0 else 0.0
        columns.append(lfilter([1.0 - kept], [1.0, -kept], column - column[0]) + column[0])
    return np.array(columns).T


@dataclass(frozen=True)
class _Fit:
    """Coefficients (n,) of one dead time, the sum of ``squares`` of the joints that moved, and the largest sag."""

    squares: float
    lag_s: Array
    lag_sigma_s: Array
    sag_rad_nm: Array
    offset_rad: Array
    max_sag_rad: Array

    @staticmethod
    def of(sent: Array, ahead: _Motion, pure: _Motion, moved: np.ndarray) -> _Fit:
        """Return the fit of the motion ``ahead`` to the commands ``sent`` (k, n) by the instruments ``pure``."""
        behind = sent - ahead.position
        lag, sigma, sag, offset, squares = (np.zeros(moved.size) for _ in range(5))
        for j in np.flatnonzero(moved).tolist():
            terms, instruments = ahead.terms(j), pure.terms(j)
            (lag[j], sag[j], offset[j]), residual = _solved(terms, instruments, behind[:, j])
            squares[j] = residual @ residual
            sigma[j] = _deviation(terms, instruments, residual)
        lag[~moved], sigma[~moved] = np.median(lag[moved]), np.median(sigma[moved])
        for j in np.flatnonzero(~moved).tolist():
            terms, instruments = ahead.terms(j), pure.terms(j)
            (sag[j], offset[j]), _ = _solved(terms[:, 1:], instruments[:, 1:], behind[:, j] - lag[j] * terms[:, 0])
        largest = np.abs(ahead.torque_nm * sag + offset).max(axis=0)
        return _Fit(float(squares.sum()), lag, sigma, sag, offset, largest)

    def servo(self, names: tuple[str, ...], dead_time_s: float, period_s: float) -> ServoModel:
        """Return the model, its insignificant terms zero."""
        least = np.maximum(SIGMAS * self.lag_sigma_s, 0.5 * period_s)
        lag = np.where(self.lag_s <= least, 0.0, self.lag_s)
        sags = (self.max_sag_rad > FOLLOWS_RAD) & (self.sag_rad_nm > 0.0)  # no joint rises under a load: friction
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
    """Smoothed angles, their rates and the torques of the rigid bodies, (k, n) each."""

    position: Array
    velocity: Array
    acceleration: Array
    torque_nm: Array

    @staticmethod
    def smoothed(arm: RobotModel, angles: Array, window: int, period_s: float) -> _Motion:
        position, velocity, acceleration = (
            np.asarray(savgol_filter(angles, window, ORDER, deriv=order, delta=period_s, axis=0)) for order in range(3)
        )
        rows = zip(position, velocity, acceleration, strict=True)
        torque_nm = np.array([arm.rigid_effort_nm(*row) for row in rows])
        return _Motion(position, velocity, acceleration, torque_nm)

    def moving(self) -> np.ndarray:
        """Return a mask (n,) of the joints that moved."""
        squares = (self.velocity**2).mean(axis=0)
        return np.asarray((squares > MOVED * squares.max()) & (squares > STILL_RAD_S**2))

    def rows(self, start: int, end: int) -> _Motion:
        """Return the rows from ``start`` to ``end``."""
        columns = (self.position, self.velocity, self.acceleration, self.torque_nm)
        return _Motion(*(column[start:end] for column in columns))

    def after(self, time_s: float) -> _Motion:
        """Return the motion ``time_s`` later, by its acceleration."""
        velocity = self.velocity + time_s * self.acceleration
        position = self.position + time_s / 2 * (self.velocity + velocity)
        return _Motion(position, velocity, self.acceleration, self.torque_nm)

    def terms(self, j: int) -> Array:
        """Return q', tau and 1 of joint ``j``, (k, 3)."""
        return np.column_stack([self.velocity[:, j], self.torque_nm[:, j], np.ones(len(self.velocity))])


def _rest_s(sent: Array, ahead: _Motion, pure: _Motion, moved: np.ndarray) -> float:
    """Return the dead time that the motion ``ahead`` leaves of that to ``sent``: the median of joints that ``moved``.

    With r the rest, u - q = (T + r) q' + (T r + r^2 / 2) q'' + ...: of the coefficients D and A of q' and q'',

        r = D - sqrt(D^2 - 2 A).
    """
    found = []
    for j in np.flatnonzero(moved).tolist():
        terms, instruments = (np.column_stack([one.terms(j), one.acceleration[:, j]]) for one in (ahead, pure))
        (delay_s, _, _, square), _ = _solved(terms, instruments, sent[:, j] - ahead.position[:, j])
        found.append(delay_s - math.sqrt(max(delay_s**2 - 2.0 * square, 0.0)))
    return float(np.median(found))


def cup_sag_m(arm: RobotModel, servo: ServoModel, position_rad: Array) -> float:
    """Return how far the cup rests from where it is commanded at ``position_rad`` (n,), unled."""
    effort_nm = arm.rigid_effort_nm(position_rad, np.zeros_like(position_rad), np.zeros_like(position_rad))
    resting_rad = position_rad - servo.sag_rad_nm * effort_nm - servo.offset_rad
    return float(np.linalg.norm(arm.tool_position_m(resting_rad) - arm.tool_position_m(position_rad)))


def _solved(terms: Array, instruments: Array, values: Array) -> tuple[Array, Array]:
    """Return coefficients c and residual of ``values`` (k,) by ``terms`` X and ``instruments`` Z, (k, m) each.

    Z^T X c = Z^T values: least squares where Z is X.
    """
    found: Array = np.asarray(np.linalg.pinv(instruments.T @ terms) @ (instruments.T @ values), dtype=np.float64)
    return found, values - terms @ found


def _deviation(terms: Array, instruments: Array, residual: Array) -> float:
    """Return the standard deviation of the first coefficient of ``_solved``.

    With the residuals' correlation rho from one period to the next the variance of independent ones is multiplied by
    (1 + rho) / (1 - rho), that of a process of first order.
    """
    square = float(residual @ residual)
    rho = float(residual[1:] @ residual[:-1]) / square if square > 0.0 else 0.0
    inflated = (1.0 + max(rho, 0.0)) / max(1.0 - rho, 1e-3)
    inverse = np.linalg.pinv(instruments.T @ terms) @ instruments.T
    variance = square / (len(residual) - terms.shape[1]) * float(inverse[0] @ inverse[0])
    return float(np.sqrt(variance * inflated))
