"""Estimate of the catch pose, its position, time and rotation, from observations of a flying ball."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from kendama_cli.artifacts.catch_pose import CatchPose
from kendama_cli.schema.arrays import Array
from kendama_cli.vision.cameras.camera_model import CameraModel
from kendama_cli.vision.cameras.triangulation import RayConstraints, ray_constraints
from kendama_cli.vision.prediction.ballistic import BallisticFit
from kendama_cli.vision.prediction.free_flight import FreeFlight
from kendama_cli.vision.prediction.kalman_flight import KalmanFlightFit
from kendama_cli.vision.settings import BallisticMotion, MotionSettings

BALLISTIC = BallisticMotion(kind="ballistic")


class CatchPoseEstimator:
    """Estimates a ball's free flight from any number of cameras with stamps of their own.

    ``motion`` chooses how closely the ball is modelled to follow gravity and drag: exactly (an information filter),
    or with a smooth wobble about the flight (a Kalman filter). Every observation costs the same.
    """

    def __init__(
        self,
        gravity_m_s2: float | ArrayLike,
        drag_per_s: float,
        rim_height_m: float,
        *,
        drag_per_m: float = 0.0,
        cup_velocity_m_s: ArrayLike = (0.0, 0.0, 0.0),
        max_sigma_m: float = 0.25,
        motion: MotionSettings = BALLISTIC,
        of_marker: bool = False,
    ) -> None:
        """``gravity_m_s2`` is a magnitude along -z or a vector (3,); no pose is given above ``max_sigma_m``.

        The drags are those of FreeFlight: k1 / m and k2 / m. ``of_marker``: the point that is seen is estimated,
        wobble and all, not the ball's centre.
        """
        vector = np.asarray(gravity_m_s2, dtype=np.float64)
        self.flight = FreeFlight(
            vector if vector.ndim else np.array([0.0, 0.0, -float(vector)]), drag_per_s, drag_per_m
        )
        self.rim_height_m = rim_height_m
        self.cup_velocity_m_s = np.asarray(cup_velocity_m_s, dtype=np.float64)
        self.max_sigma_m = max_sigma_m
        self._motion, self._of_marker = motion, of_marker
        self.reset()

    def reset(self) -> None:
        """Forget every observation: the next one begins a new flight."""
        self._fit: BallisticFit | KalmanFlightFit = (
            BallisticFit(self.flight)
            if isinstance(self._motion, BallisticMotion)
            else KalmanFlightFit(self.flight, self._motion, of_marker=self._of_marker)
        )

    @property
    def n_observations(self) -> int:
        """Scalar observations so far: two per pixel, three per position."""
        return self._fit.count

    @property
    def residual_ratio(self) -> float:
        """Chi-square of the residuals per degree of freedom: about 1 where noise, calibration and model are right."""
        return self._fit.residual_ratio

    def update_pixels(self, camera: CameraModel, t_s: float, centre_px: ArrayLike, covariance_px2: ArrayLike) -> None:
        """Take the ball's position in one image; order and rate are free.

        Parameters
        ----------
        camera : CameraModel
            The calibrated camera that took it.
        t_s : float
            The middle of its exposure [s], on the clock of all observations.
        centre_px : array_like, shape (2,)
            The centre of the sphere's image [px].
        covariance_px2 : array_like, shape (2, 2)
            Its covariance [px^2].
        """
        self._fit.add(t_s, ray_constraints(camera, np.asarray(centre_px), np.asarray(covariance_px2)))

    def update_sight(self, t_s: float, sight: RayConstraints) -> None:
        """Take one image's measurement, whose constraints are known already."""
        self._fit.add(t_s, sight)

    def update_position(self, t_s: float, position_m: ArrayLike, covariance_m2: ArrayLike) -> None:
        """Take the ball's position by motion capture.

        Parameters
        ----------
        t_s : float
            When [s], on the clock of all observations.
        position_m : array_like, shape (3,)
            The ball's centre in the world [m].
        covariance_m2 : array_like, shape (3, 3)
            Its covariance [m^2]; numpy's LinAlgError is raised where it is not positive definite.
        """
        factor = np.linalg.cholesky(np.asarray(covariance_m2, dtype=np.float64))
        whiten = np.asarray(np.linalg.inv(factor), dtype=np.float64)
        self._fit.add(t_s, RayConstraints(whiten, whiten @ np.asarray(position_m, dtype=np.float64), np.zeros(3), 1.0))

    def state_at(self, t_s: float) -> Array | None:
        """Position and velocity (6,) of the ball at ``t_s``, or None as long as they are not known."""
        known = self._fit.state(t_s)
        return None if known is None else np.concatenate(known)

    def position_covariance_at(self, t_s: float) -> Array | None:
        """Covariance (3, 3) [m^2] of the ball's position at ``t_s``, or None as long as it is not known."""
        ball = self._fit.ball_state(t_s)
        return None if ball is None else ball.covariance_m2

    def catch(self, rim_height_m: float | None = None) -> CatchPose | None:
        """Return the position and time at which the ball falls through the rim plane.

        Parameters
        ----------
        rim_height_m : float, optional
            Height of the plane in the world [m]; by default that of the estimator.

        Returns
        -------
        CatchPose or None
            None while that is not known to ``max_sigma_m``, or where it never happens.

        Notes
        -----
        A position error e moves the crossing in time by -e_z / v_z and in position by e - v e_z / v_z, with v the
        velocity there; both carry the state's covariance, scaled up where the residuals are too large.
        """
        height = self.rim_height_m if rim_height_m is None else rim_height_m
        crossing_s = self._crossing_s(height)
        ball = None if crossing_s is None else self._fit.ball_state(crossing_s)
        if crossing_s is None or ball is None:
            return None
        speed, spread = ball.velocity_m_s, ball.covariance_m2
        sweep = np.eye(3)
        sweep[:, 2] -= speed / speed[2]
        covariance = sweep @ spread @ sweep.T
        if not 0 <= float(covariance.trace()) < self.max_sigma_m**2:
            return None
        return CatchPose(
            t_s=crossing_s,
            position_m=ball.position_m,
            velocity_m_s=speed,
            covariance_m2=(covariance + covariance.T) / 2,
            time_sigma_s=math.sqrt(max(float(spread[2, 2]), 0.0)) / abs(float(speed[2])),
            rotation_wxyz=opening_against(speed - self.cup_velocity_m_s),
            n_observations=self._fit.count,
        )

    def _crossing_s(self, height_m: float) -> float | None:
        """Return the time at which the ball falls through ``height_m``; a wobble needs a second look or two."""
        crossing_s = self._fit.reference_s
        for _ in range(1 if isinstance(self._fit, BallisticFit) else 4):
            known = self._fit.state(crossing_s)
            step_s = None if known is None else self._fit.flight.descent_s(*known, height_m)
            if step_s is None:
                return None
            crossing_s += step_s
            if abs(step_s) < 1e-7:
                break
        return crossing_s


def opening_against(velocity_m_s: ArrayLike) -> Array:
    """Return the smallest rotation wxyz (4,) that turns the cup's axis (0, 0, 1) against ``velocity_m_s`` (3,).

    A velocity of zero, or straight up, leaves the cup upright: no rotation is defined.
    """
    x, y, z = (float(value) for value in np.asarray(velocity_m_s))
    speed = math.sqrt(x * x + y * y + z * z)
    if speed == 0 or speed - z <= 1e-9 * speed:
        return np.array([1.0, 0.0, 0.0, 0.0])
    length = math.sqrt(2 * speed * (speed - z))
    return np.array([(speed - z) / length, y / length, -x / length, 0.0])
