"""Sequential test for free flight: the time at which the rope goes slack."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from kendama_cli.schema.arrays import Array, array
from kendama_cli.vision.prediction.free_flight import FreeFlight
from kendama_cli.vision.settings import OnsetSettings

SLACKENING = 3.0
"""Free flight begins where the tension falls below that of a taut rope divided by this."""


@dataclass(frozen=True)
class FreeFlightFound:
    """Free flight was declared at ``declared_s``; every observation from ``since_s`` on belongs to it."""

    since_s: float
    declared_s: float


class FreeFlightOnset:
    """Test whether the rope is still under tension.

    Over windows of the last n positions the motion z'' = g - k z' + a h is fitted, with h the unit vector from the
    ball to where the rope leaves the upright cup of ``edge_m`` radius (below it: to the tie point): position, velocity
    and a, linear least squares. Free flight (a = 0) against a taut rope (a >= a_min, the minimum tension) has the log
    likelihood ratio (a_min / 2 - a) a_min / sigma_a^2; flight is declared when its maximum over n exceeds a threshold,
    and the maximum's window is known to be free. Drag that grows with the speed, a hundredth of that tension, is
    left out.
    """

    def __init__(self, settings: OnsetSettings, flight: FreeFlight, edge_m: float = 0.0) -> None:
        self._settings = settings
        self._flight = flight
        self._edge_m = edge_m
        self.reset()

    def reset(self) -> None:
        """Forget every observation."""
        self._times: list[float] = []
        self._points: list[Array] = []
        self._whiten: list[Array] = []
        self._ties: list[Array] = []

    def update(
        self, t_s: float, position_m: ArrayLike, covariance_m2: ArrayLike, tie_m: ArrayLike
    ) -> FreeFlightFound | None:
        """Take the ball (3,) with its covariance (3, 3) and the tie point (3,) at ``t_s``, in order of time."""
        self._times.append(t_s)
        self._points.append(array("position_m", position_m, (3,)))
        self._ties.append(array("tie_m", tie_m, (3,)))
        factor = np.linalg.cholesky(np.asarray(covariance_m2, dtype=np.float64))
        self._whiten.append(np.asarray(np.linalg.inv(factor), dtype=np.float64))
        for past in (self._times, self._points, self._ties, self._whiten):
            del past[: -self._settings.max_frames]
        if len(self._times) < self._settings.min_frames:
            return None
        tension, variance = self._tensions()
        least = self._settings.min_tension_m_s2
        if np.max(_free_over_taut(tension, variance, least)) <= self._settings.threshold:
            return None
        # a rope that slackens little by little has too little tension to be called taut and still bends the flight
        best = int(np.argmax(_free_over_taut(tension, variance, least / SLACKENING)))
        first = len(self._times) - (best + self._settings.min_frames)
        kept = min(first + self._settings.skipped_frames, len(self._times) - self._settings.min_frames)
        return FreeFlightFound(self._times[max(kept, first)], t_s)

    def _tensions(self) -> tuple[Array, Array]:
        """Acceleration along the rope and its variance, for windows of min_frames, min_frames + 1, ... frames."""
        t = np.array(self._times)
        s = t - t[-1]
        points, whiten = np.array(self._points), np.array(self._whiten)
        rope = np.array(self._ties) - points
        outward = rope[:, :2] / np.maximum(np.linalg.norm(rope[:, :2], axis=1), 1e-9)[:, None]
        rope[:, :2] -= np.where(rope[:, 2:] < 0.0, self._edge_m, 0.0) * outward
        rope /= np.maximum(np.linalg.norm(rope, axis=1), 1e-9)[:, None]
        n = len(s)
        design = np.zeros((n, 3, 7))
        design[:, :, :3] = np.eye(3)
        design[:, :, 3:6] = self._flight.velocity_gain_s(s)[:, None, None] * np.eye(3)
        design[:, :, 6] = _twice_integrated(rope, t)
        fall = self._flight.gravity_gain_s2(s)[:, None] * self._flight.gravity_m_s2
        design = whiten @ design
        right = (whiten @ (points - fall)[:, :, None])[:, :, 0]
        information = np.einsum("nij,nik->njk", design, design)[::-1].cumsum(axis=0)
        vector = np.einsum("nij,ni->nj", design, right)[::-1].cumsum(axis=0)
        first = self._settings.min_frames - 1
        scale = np.array([1.0, 1.0, 1.0, 0.1, 0.1, 0.1, 0.005])  # the unknowns' sizes, so that inversion is sound
        covariance = np.linalg.inv(information[first:] / np.outer(scale, scale) ** -1) * np.outer(scale, scale)
        min_tension_m_s2 = np.einsum("nj,nj->n", covariance[:, 6, :], vector[first:])
        return np.asarray(min_tension_m_s2), np.asarray(covariance[:, 6, 6])


def _free_over_taut(tension: Array, variance: Array, least: float) -> Array:
    return np.asarray((least / 2 - tension) * least / variance)


def _twice_integrated(rate: Array, t: Array) -> Array:
    """Double integral (n, 3) of ``rate`` (n, 3) that is linear between ``t`` (n,); it starts from rest at ``t[0]``."""
    dt = np.diff(t)[:, None]
    speed = np.vstack([np.zeros(3), np.cumsum(dt * (rate[1:] + rate[:-1]) / 2, axis=0)])
    step = dt * speed[:-1] + dt**2 * (2 * rate[:-1] + rate[1:]) / 6
    return np.vstack([np.zeros(3), np.cumsum(step, axis=0)])
