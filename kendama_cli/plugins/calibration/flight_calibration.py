"""Gravity, drag, noise and wobble from recorded flights: the maximum of their restricted likelihood."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize

from kendama_cli.plugins.calibration.flight_search import GRAVITY_M_S2, RecordedFlight
from kendama_cli.schema.arrays import Array
from kendama_cli.vision.prediction.catch_pose import BALLISTIC, CatchPoseEstimator
from kendama_cli.vision.prediction.free_flight import FreeFlight
from kendama_cli.vision.settings import ColouredMotion, MotionSettings

GRAVITY_SIGMA_M_S2 = 0.3
"""Recordings are off by so much: 3 % in scale, 1.8 deg in tilt."""
THINNED = 60
"""Samples of a flight that the likelihood looks at: what is smooth needs no more."""
MOST_FLIGHTS = 12
LEAST_SIGMA_M = 1e-5
"""No camera measures better. Without a floor the likelihood of exact data grows without end as sigma goes to 0, and
numbers that are lost in rounding decide on gravity and drag."""
PRIORS = {  # median and spread (natural log) of what is plausible before any flight was seen
    "drag": (0.05, 1.5),
    "sigma_m": (1e-3, 2.5),
    "intensity_m2_s3": (1e-2, 2.5),
    "wobble_m": (1e-3, 2.0),
    "length_s": (0.2, 1.0),
}


@dataclass(frozen=True)
class FlightModel:
    """Flight of balls in one laboratory's recordings: gravity vector (3,), drag, noise of a sample, wobble."""

    gravity_m_s2: Array
    drag_per_s: float
    sigma_m: float
    motion: MotionSettings
    flights: int
    """How many flights this was learned from."""

    @property
    def tilt_rad(self) -> Array:
        """The tilt of gravity towards +x and +y (2,)."""
        return np.asarray(np.arctan2(self.gravity_m_s2[:2], -self.gravity_m_s2[2]))

    def estimator(self, height_m: float) -> CatchPoseEstimator:
        """Make an estimator of the seen point's crossing of ``height_m`` that believes in this model."""
        return CatchPoseEstimator(
            self.gravity_m_s2,
            self.drag_per_s,
            height_m,
            max_sigma_m=1.0,
            motion=self.motion,
            of_marker=True,
        )


NOMINAL = FlightModel(np.array([0.0, 0.0, -GRAVITY_M_S2]), 0.0, 1e-3, BALLISTIC, 0)
"""What is believed without any flight: upright standard gravity and a round ball."""


def fit_flight_model(flights: Sequence[RecordedFlight]) -> FlightModel:
    """Fit the model under which ``flights`` are most likely; NOMINAL without any.

    Along each axis a flight is z(s) = z0 + a(s) v0 + b(s) g + noise, with z0 and v0 unknown, g common to all flights
    and normal about standard gravity, and the noise of covariance

        K(s, u) = q (m^2 M / 2 - m^3 / 6) + w^2 (1 + d) exp(-d) + sigma^2 [s = u],

    m = min(s, u), M = max(s, u), d = sqrt(3) |s - u| / length: process noise, a Matern-3/2 wobble, white noise. The
    drag k, sigma, q, w and the length maximise the likelihood restricted to what z0, v0 and g cannot explain
    (Patterson and Thompson 1971), times wide log-normal priors. Along z the covariance is c^2 K with c of its own
    (profiled out), for drag that grows with the speed is not all in k; K is how the ball strays sideways.
    """
    if not flights:
        return NOMINAL
    chosen = np.unique(np.linspace(0, len(flights) - 1, MOST_FLIGHTS).round().astype(int))
    thin = _thinned([flights[i] for i in chosen])
    medians = np.log([median for median, _ in PRIORS.values()])
    spreads = np.array([spread for _, spread in PRIORS.values()])

    def loss(scaled: Array) -> float:
        return 0.5 * float(scaled @ scaled) - _Likelihood(thin, np.exp(medians + spreads * scaled)).value

    corners = np.vstack([np.zeros(len(PRIORS)), 0.5 * np.eye(len(PRIORS))])
    best = minimize(
        loss,
        corners[0],
        method="Nelder-Mead",
        options={"maxiter": 400, "xatol": 0.02, "fatol": 0.02, "initial_simplex": corners},
    )
    values = np.asarray(np.exp(medians + spreads * best.x), dtype=np.float64)
    drag, sigma_m, intensity, wobble_m, length_s = (float(value) for value in values)
    sigma_m = max(sigma_m, LEAST_SIGMA_M)
    motion = ColouredMotion("coloured", 1.0, wobble_m, length_s, intensity)
    gravity_m_s2 = _pooled_gravity(flights, drag) if len(flights) > 1 else _Likelihood(thin, values).gravity_m_s2
    return FlightModel(gravity_m_s2, drag, sigma_m, motion, len(flights))


def _pooled_gravity(flights: Sequence[RecordedFlight], drag_per_s: float) -> Array:
    """Fit the gravity (3,) of all ``flights`` (two at least), each with a start and velocity by least squares.

    Weighed against standard gravity by how far the flights differ, which is more than their noise: a wobble that lasts
    as long as a flight looks like gravity. So all flights count alike, not only those that the likelihood looks at.
    """
    standard = np.array([0.0, 0.0, -GRAVITY_M_S2])
    flight = FreeFlight(standard, drag_per_s)
    off, weight = np.zeros((len(flights), 3)), np.zeros(len(flights))
    for i, one in enumerate(flights):
        fall = flight.gravity_gain_s2(one.t_s)
        free = np.linalg.qr(np.column_stack([np.ones_like(one.t_s), flight.velocity_gain_s(one.t_s)]))[0]
        seen = fall - free @ (free.T @ fall)
        weight[i] = seen @ seen
        off[i] = seen @ (one.position_m - fall[:, None] * standard) / weight[i]
    mean = weight @ off / weight.sum()
    spread = weight @ (off - mean) ** 2 / (len(flights) - 1)
    return np.asarray(standard + mean / (1.0 + spread / weight.sum() / GRAVITY_SIGMA_M_S2**2))


@dataclass(frozen=True)
class _Thinned:
    """All flights (f) in arrays of one length (n): fewer samples are filled up with zeros where ``there`` is not."""

    t_s: Array
    position_m: Array
    there: NDArray[np.bool_]


def _thinned(flights: Sequence[RecordedFlight]) -> _Thinned:
    t_s, places = np.zeros((len(flights), THINNED)), np.zeros((len(flights), THINNED, 3))
    there = np.zeros((len(flights), THINNED), dtype=np.bool_)
    for i, flight in enumerate(flights):
        kept = np.unique(np.linspace(0, len(flight.t_s) - 1, THINNED).round().astype(int))
        t_s[i, : len(kept)], places[i, : len(kept)], there[i, : len(kept)] = (
            flight.t_s[kept],
            flight.position_m[kept],
            1,
        )
    return _Thinned(t_s, places, there)


class _Likelihood:
    """Restricted log likelihood of flights, and the gravity that they agree on."""

    def __init__(self, flights: _Thinned, values: Array) -> None:
        drag, sigma_m, intensity, wobble_m, length_s = (float(value) for value in values)
        sigma_m = max(sigma_m, LEAST_SIGMA_M)
        flight = FreeFlight(np.array([0.0, 0.0, -GRAVITY_M_S2]), drag)
        s, there = flights.t_s, flights.there
        b = flight.gravity_gain_s2(s)[..., None]
        fallen = flights.position_m - b * flight.gravity_m_s2
        known = np.concatenate([np.ones_like(b), flight.velocity_gain_s(s)[..., None], b, fallen], axis=2)
        low, high = np.minimum(s[:, :, None], s[:, None]), np.maximum(s[:, :, None], s[:, None])
        d = (math.sqrt(3) / length_s) * (high - low)
        covariance = intensity * low**2 * (high / 2 - low / 6) + wobble_m**2 * (1 + d) * np.exp(-d)
        covariance *= there[:, :, None] & there[:, None]
        n = np.arange(s.shape[1])
        covariance[:, n, n] += np.where(there, sigma_m**2, 1.0)
        squares, log_determinant = _whitened_squares(covariance, known * there[..., None])
        # what start and velocity explain is taken out: the Schur complement of their block
        (xx, xy), (_, yy) = squares[:, :2, :2].transpose(1, 2, 0)
        spread = xx * yy - xy * xy
        if not (np.isfinite(log_determinant) and (spread > 0).all()):
            self.value, self.gravity_m_s2 = -1e12, flight.gravity_m_s2
            return
        inverse = np.stack([np.stack([yy, -xy], 1), np.stack([-xy, xx], 1)], 1) / spread[:, None, None]
        left = (squares[:, 2:, 2:] - squares[:, 2:, :2] @ inverse @ squares[:, :2, 2:]).sum(axis=0)
        weight = GRAVITY_SIGMA_M_S2**-2 + float(left[0, 0])
        self.gravity_m_s2 = flight.gravity_m_s2 + left[0, 1:] / weight
        squares_by_axis = left[1:, 1:].diagonal() - left[0, 1:] ** 2 / weight
        determinants = log_determinant + float(np.log(spread).sum()) + math.log(weight)
        freedom = float(there.sum() - 2 * len(there))
        vertical = freedom * (1 + math.log(max(float(squares_by_axis[2]), 1e-300) / freedom))
        self.value = -0.5 * (float(squares_by_axis[:2].sum()) + vertical + 3 * determinants)


def _whitened_squares(covariance: Array, known: Array) -> tuple[Array, float]:
    """Return U^T C^-1 U (f, k, k) for C (f, n, n) and U (f, n, k), and the sum of log det C.

    Gaussian elimination of all flights at once, column by column: matrices so small gain nothing from a library that
    wakes its threads for each.
    """
    n, log_determinant = covariance.shape[1], 0.0
    whole = np.concatenate([covariance, known], axis=2)
    for j in range(n):
        pivot = np.maximum(whole[:, j, j], 1e-300)
        log_determinant += float(np.log(pivot).sum())
        whole[:, j, j:] /= np.sqrt(pivot)[:, None]
        row = whole[:, j, j + 1 :]
        whole[:, j + 1 :, j + 1 :] -= row[:, : n - j - 1, None] * row[:, None]
    white = whole[:, :, n:]
    return np.einsum("fni,fnj->fij", white, white), log_determinant
