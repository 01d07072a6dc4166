"""From observations of a flying ball to where, when and how to hold the cup."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from kendama_cli.artifacts.catch_pose import CatchPose
from kendama_cli.artifacts.checks import Array
from kendama_cli.vision.camera_model import CameraModel
from kendama_cli.vision.free_flight import FreeFlight
from kendama_cli.vision.triangulation import NEAREST_DEPTH_M, SightRows, sight_rows

MIN_FREEDOM = 8
"""Residuals are believed only with this many observations (scalar) beyond the six unknowns."""


class CatchPoseEstimator:
    """Least squares on a ball's free flight, from any number of cameras with stamps of their own.

    The state is position and velocity at the first observation. ``FreeFlight`` makes every later position linear in
    it, drag included, and ``sight_rows`` makes every pixel linear in the position; the depth that weights a pixel
    comes from the estimate itself.
    """

    def __init__(
        self,
        gravity_m_s2: float | ArrayLike,
        drag_per_s: float,
        rim_height_m: float,
        *,
        cup_velocity_m_s: ArrayLike = (0.0, 0.0, 0.0),
        max_sigma_m: float = 0.25,
    ) -> None:
        """``gravity_m_s2`` is a magnitude along -z or a vector (3,); no pose is told above ``max_sigma_m``."""
        vector = np.asarray(gravity_m_s2, dtype=np.float64)
        self.flight = FreeFlight(vector if vector.ndim else np.array([0.0, 0.0, -float(vector)]), drag_per_s)
        self.rim_height_m = rim_height_m
        self.cup_velocity_m_s = np.asarray(cup_velocity_m_s, dtype=np.float64)
        self.max_sigma_m = max_sigma_m
        self.reset()

    def reset(self) -> None:
        """Forget every observation: the next one begins a new flight."""
        self._start_s: float | None = None
        self._count = 0
        self._rows = np.empty((64, 6))
        self._right = np.empty(64)
        self._depth_rows = np.empty((64, 6))
        self._depth_right = np.empty(64)
        self._state: Array | None = None
        self._covariance: Array | None = None
        self._excess = 1.0
        self._solved = 0

    @property
    def n_observations(self) -> int:
        """Scalar observations so far: two per pixel, three per position."""
        return self._count

    @property
    def residual_ratio(self) -> float:
        """Chi-square of the residuals per degree of freedom: about 1 where noise, calibration and model are right."""
        self._solve()
        return self._excess

    def update_pixels(self, camera: CameraModel, t_s: float, centre_px: ArrayLike, covariance_px2: ArrayLike) -> None:
        """Take the ball's centre (2,) in one image with its covariance (2, 2); order and rate are free."""
        self.update_sight(t_s, sight_rows(camera, centre_px, covariance_px2))

    def update_sight(self, t_s: float, sight: SightRows) -> None:
        """Take what one image says, where its equations are already at hand."""
        self._append(t_s, sight.rows, sight.right, sight.depth_row, sight.depth_right)

    def update_position(self, t_s: float, position_m: ArrayLike, covariance_m2: ArrayLike) -> None:
        """Take the ball's centre (3,) in the world, as motion capture tells it, with its covariance (3, 3)."""
        factor = np.linalg.cholesky(np.asarray(covariance_m2, dtype=np.float64))
        whiten = np.asarray(np.linalg.inv(factor), dtype=np.float64)
        self._append(t_s, whiten, whiten @ np.asarray(position_m, dtype=np.float64), np.zeros(3), 1.0)

    def state_at(self, t_s: float) -> Array | None:
        """Position and velocity (6,) of the ball at ``t_s``, or None as long as they are not known."""
        self._solve()
        if self._state is None or self._start_s is None:
            return None
        start, velocity = self._state[:3], self._state[3:]
        s = t_s - self._start_s
        return np.concatenate([self.flight.position_m(start, velocity, s), self.flight.velocity_m_s(velocity, s)])

    def catch(self, rim_height_m: float | None = None) -> CatchPose | None:
        """Where and when the ball falls through the rim plane; None while that is not known, or never happens.

        With F = d(position at the crossing)/d(state) and crossing velocity v, the time varies by -F_z / v_z and the
        crossing by F - v F_z / v_z; both carry the state's covariance, scaled up where the residuals are too large.
        """
        self._solve()
        if self._state is None or self._covariance is None or self._start_s is None:
            return None
        start, velocity = self._state[:3], self._state[3:]
        s = self.flight.descent_s(start, velocity, self.rim_height_m if rim_height_m is None else rim_height_m)
        if s is None:
            return None
        crossing = self.flight.position_m(start, velocity, s)
        speed = self.flight.velocity_m_s(velocity, s)
        gain = float(self.flight.velocity_gain_s(s))
        by_state = np.hstack([np.eye(3), gain * np.eye(3)])
        by_time = -by_state[2] / speed[2]
        by_crossing = by_state + np.outer(speed, by_time)
        covariance = by_crossing @ self._covariance @ by_crossing.T
        variance_s2 = float(by_time @ self._covariance @ by_time)
        if not 0 <= np.trace(covariance) < self.max_sigma_m**2:
            return None
        return CatchPose(
            t_s=self._start_s + s,
            position_m=crossing,
            velocity_m_s=speed,
            covariance_m2=(covariance + covariance.T) / 2,
            time_sigma_s=math.sqrt(max(variance_s2, 0.0)),
            rotation_wxyz=opening_against(speed - self.cup_velocity_m_s),
            n_observations=self._count,
        )

    def _append(self, t_s: float, rows: Array, right: Array, depth_row: Array, depth_right: float) -> None:
        if self._start_s is None:
            self._start_s = t_s
        s = t_s - self._start_s
        a, fall = self.flight.velocity_gain_s(s), self.flight.gravity_gain_s2(s) * self.flight.gravity_m_s2
        n, end = self._count, self._count + len(rows)
        if end > len(self._rows):
            grown = 2 * len(self._rows)
            self._rows, self._depth_rows = (np.resize(old, (grown, 6)) for old in (self._rows, self._depth_rows))
            self._right, self._depth_right = (np.resize(old, grown) for old in (self._right, self._depth_right))
        self._rows[n:end] = np.hstack([rows, a * rows])
        self._right[n:end] = right - rows @ fall
        self._depth_rows[n:end] = np.concatenate([depth_row, a * depth_row])
        self._depth_right[n:end] = depth_right + depth_row @ fall
        self._count = end

    def _solve(self) -> None:
        if self._solved == self._count:
            return
        self._solved = self._count
        n = self._count
        if n < 6:
            return
        rows, right = self._rows[:n], self._right[:n]
        state = self._state
        for _ in range(1 if state is not None else 3):
            weight = np.ones(n) if state is None else self._weight(state)
            weighted = rows * weight[:, None]
            information = weighted.T @ weighted
            try:
                covariance = np.asarray(np.linalg.inv(information), dtype=np.float64)
            except np.linalg.LinAlgError:
                return
            state = covariance @ (weighted.T @ (right * weight))
        if state is None or not (np.isfinite(state).all() and (covariance.diagonal() > 0).all()):
            return
        freedom = n - 6
        residual = (rows @ state - right) * self._weight(state)
        self._excess = float(residual @ residual) / freedom if freedom >= MIN_FREEDOM else 1.0
        self._state, self._covariance = state, covariance * max(1.0, self._excess)

    def _weight(self, state: Array) -> Array:
        n = self._count
        depth = self._depth_rows[:n] @ state + self._depth_right[:n]
        return np.asarray(1.0 / np.maximum(depth, NEAREST_DEPTH_M))


def opening_against(velocity_m_s: ArrayLike) -> Array:
    """The smallest rotation wxyz (4,) that turns the cup's axis (0, 0, 1) against ``velocity_m_s`` (3,).

    A velocity of zero, or straight up, leaves the cup upright: there is nothing to turn it by.
    """
    velocity = np.asarray(velocity_m_s, dtype=np.float64)
    speed = float(np.linalg.norm(velocity))
    upright = np.array([1.0, 0.0, 0.0, 0.0])
    if speed == 0:
        return upright
    axis = -velocity / speed
    quaternion = np.array([1.0 + axis[2], -axis[1], axis[0], 0.0])
    length = float(np.linalg.norm(quaternion))
    return quaternion / length if length > 1e-9 else upright
