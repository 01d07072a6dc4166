"""A flight that its model describes only roughly: a Kalman filter with process noise and a coloured residual."""

from __future__ import annotations

import math

import numpy as np

from kendama_cli.schema.arrays import Array
from kendama_cli.vision.cameras.triangulation import MIN_DEPTH_M, RayConstraints
from kendama_cli.vision.prediction.ballistic import MIN_FREEDOM, UNKNOWNS, BallisticFit, BallState
from kendama_cli.vision.prediction.free_flight import FreeFlight
from kendama_cli.vision.settings import ColouredMotion

STATES = 12
WIDE_POSITION_M, WIDE_VELOCITY_M_S = 1.0, 10.0
"""Prior of the ball's state: next to nothing is known."""
BEGUN = 1 / 20
"""The filter begins where the plain fit knows the ball to this part of the prior: it is linear about that state."""


class KalmanFlightFit:
    """The ball's state from measurements in order of time, each at the same cost.

    x = (p, v, w, w') with v' = g - drag + white noise of intensity q; what is seen is p + w, and what is estimated p,
    or p + w ``of_marker`` (the seen point itself). w is a Matern-3/2 process (lambda = sqrt(3) / length),

        w'' = -lambda^2 w - 2 lambda w' + white noise,  var(w) = sigma^2,

    which is least squares with that residual covariance (generalised least squares). The noise of a measurement has
    ``noise_scale`` times its stated standard deviation: nothing is scaled by the residuals of one flight.
    Begins with the plain fit's state as soon as that is known, and takes the measurements that led to it once more.
    """

    def __init__(self, flight: FreeFlight, motion: ColouredMotion, *, of_marker: bool = False) -> None:
        self.flight, self._motion, self._of_marker = flight, motion, of_marker
        self._plain = BallisticFit(flight)
        self._waiting: list[tuple[float, RayConstraints]] = []
        self.count = 0
        self._mean: Array | None = None
        self._covariance = np.zeros((STATES, STATES))
        self._square = 0.0
        self.log_likelihood = 0.0
        """Log likelihood of all measurements, each given those before it; the constant and the depths are left out."""
        self.reference_s = 0.0

    @property
    def residual_ratio(self) -> float:
        """Mean square of the innovations, each over its standard deviation."""
        freedom = self.count - UNKNOWNS
        return self._square / freedom if self._mean is not None and freedom >= MIN_FREEDOM else 1.0

    def add(self, t_s: float, sight: RayConstraints) -> None:
        """Take one measurement; stamps may go back by the few milliseconds between two cameras, no farther."""
        self.count += len(sight.right)
        if self._mean is not None:
            self._take(t_s, sight)
            return
        self._plain.add(t_s, sight)
        self._waiting.append((t_s, sight))
        self._waiting.sort(key=lambda one: one[0])
        first_s = self._waiting[0][0]
        known = self._plain.state(first_s)
        if known is None or not self._plain.within(BEGUN * WIDE_POSITION_M, BEGUN * WIDE_VELOCITY_M_S):
            return
        self._mean = np.concatenate([*known, np.zeros(STATES - UNKNOWNS)])
        wide = np.repeat([WIDE_POSITION_M**2, WIDE_VELOCITY_M_S**2, *_still(self._motion)], 3)
        self._covariance, self.reference_s = np.diag(wide), first_s
        for one in self._waiting:
            self._take(*one)
        self._waiting = []

    def state(self, t_s: float) -> tuple[Array, Array] | None:
        """Position and velocity (3,) at ``t_s``; None while not known."""
        if self._mean is None:
            return None
        mean = self._mean_over(t_s - self.reference_s)
        return (mean[0] + mean[2], mean[1] + mean[3]) if self._of_marker else (mean[0], mean[1])

    def ball_state(self, t_s: float) -> BallState | None:
        """Return the ball at ``t_s``, with its position's covariance."""
        known = self.state(t_s)
        if known is None:
            return None
        p = self._covariance_over(t_s - self.reference_s)
        wobble = p[6:9, 6:9] + p[:3, 6:9] + p[6:9, :3] if self._of_marker else 0.0
        return BallState(*known, p[:3, :3] + wobble)

    def _take(self, t_s: float, sight: RayConstraints) -> None:
        if self._mean is None:
            return
        late = min(t_s - self.reference_s, 0.0)
        if late == 0.0:
            self._mean = self._mean_over(t_s - self.reference_s).ravel()
            self._covariance = self._covariance_over(t_s - self.reference_s)
            self.reference_s = t_s
        # a stamp from before is held against the flight traced back
        position, _ = self.flight.moved(self._mean[:3], self._mean[3:6], late)
        ahead = self.flight.transition(self._mean[3:6], late).position_s
        depth = float(sight.depth_row @ position) + sight.depth_right
        unit = self._motion.noise_scale * max(depth, MIN_DEPTH_M)
        rows = sight.rows / unit
        design = np.zeros((len(rows), STATES))
        design[:, :3], design[:, 3:6], design[:, 6:9] = rows, rows @ ahead, rows
        innovation = sight.right / unit - rows @ (position + self._mean[6:9])
        crossed = self._covariance @ design.T
        spread = design @ crossed + np.eye(len(rows))
        gain = np.linalg.solve(spread, crossed.T).T
        square = float(innovation @ np.linalg.solve(spread, innovation))
        self._square += square
        unlikely = square + float(np.linalg.slogdet(spread)[1]) + 2 * len(rows) * math.log(self._motion.noise_scale)
        self.log_likelihood -= unlikely / 2
        self._mean = self._mean + gain @ innovation
        covariance = self._covariance - gain @ crossed.T
        self._covariance = (covariance + covariance.T) / 2

    def _mean_over(self, s: float) -> Array:
        """Return the mean after ``s`` seconds, a row for each of p, v, w, w' (4, 3)."""
        if self._mean is None:
            raise ValueError("nothing is known yet")
        mean = self._mean.reshape(-1, 3)
        ahead: Array = mean.copy()
        ahead[0], ahead[1] = self.flight.moved(mean[0], mean[1], s)
        ahead[2:4] = self._wobble(s) @ mean[2:4]
        return ahead

    def _covariance_over(self, s: float) -> Array:
        """Return the covariance after ``s`` seconds; backward, nothing is forgotten."""
        if self._mean is None:
            raise ValueError("nothing is known yet")
        wobble, flown = self._wobble(s), self.flight.transition(self._mean[3:6], s)
        ahead = np.eye(STATES)
        ahead[:3, 3:6], ahead[3:6, 3:6] = flown.position_s, flown.velocity
        ahead[6:12, 6:12] = _per_axis(wobble)
        covariance = ahead @ self._covariance @ ahead.T
        if s > 0:
            q, added = self._motion.intensity_m2_s3, np.zeros((4, 4))
            added[0, 0], added[1, 1] = q * s**3 / 3, q * s
            added[0, 1] = added[1, 0] = q * s**2 / 2
            still = np.diag(_still(self._motion))
            added[2:4, 2:4] = still - wobble @ still @ wobble.T
            covariance += _per_axis(added)
        return covariance

    def _wobble(self, s: float) -> Array:
        """Return the transition of w and w' along one axis over ``s`` seconds (2, 2); backward they stay."""
        if s <= 0:
            return np.eye(2)
        decay = math.sqrt(3) / self._motion.length_s
        fade, phase = math.exp(-decay * s), decay * s
        return np.array([[fade * (1 + phase), fade * s], [-fade * decay * phase, fade * (1 - phase)]])


_AXES = np.arange(3)


def _per_axis(block: Array) -> Array:
    """Repeat ``block`` (k, k) for x, y and z: (3 k, 3 k)."""
    k = len(block)
    whole = np.zeros((k, 3, k, 3))
    whole[:, _AXES, :, _AXES] = block
    return whole.reshape(3 * k, 3 * k)


def _still(motion: ColouredMotion) -> list[float]:
    """Stationary variances of the wobble and its rate."""
    sigma, decay = motion.sigma_m, math.sqrt(3) / motion.length_s
    return [sigma**2, (decay * sigma) ** 2]
