"""A model of the swing that is fitted to rollouts: it is linear in its weights, and knows nothing of pendulums.

    phi'' = g(phi) + k(phi) phi'^2 + d(phi) phi' + b(phi) a

with the cup's acceleration a, and g, k (odd) and d, b (even) piecewise linear between nodes of the angle. Fitted is
the way between readings: over a few of them, beginning with any angle and rate, the rate and the angle follow from
single and double integrals of the terms, along the path through the readings. Least squares, with a weak prior that
the functions bend little, gives the weights' mean and covariance (Bayesian linear regression).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from kendama_cli.learning.state import SwingState
from kendama_cli.plugins.learners import swing_model_kernel as kernel
from kendama_cli.schema.arrays import Array

NODES = 19
"""Of each function, from 0 to 180 degrees."""
PARTS = 4
TOGETHER = 8
"""Readings that are fitted as one way."""
BEND = np.diff(np.eye(NODES), 2, axis=0)


class SwingModel:
    """Data of the rollouts so far, as the normal equations of the fit: ``gram`` (n, n) and ``moment`` (n,)."""

    def __init__(self, angle_noise_rad: float, rate_noise_rad_s: float) -> None:
        """Set the standard deviations of the readings, which weigh the angle against the rate."""
        n = PARTS * NODES
        self._noise = angle_noise_rad, rate_noise_rad_s
        self.gram, self.moment = np.zeros((n, n)), np.zeros(n)
        self.squares, self.equations = 0.0, 0

    def add(self, times_s: Sequence[float], readings: Sequence[SwingState]) -> None:
        """Learn from the readings of a rollout."""
        if len(readings) < 3:
            return
        t, states = np.array(times_s), np.array(readings)
        states[:, 2] = np.unwrap(states[:, 2])
        for first in range(0, len(t) - 2, TOGETHER - 1):
            part = slice(first, first + TOGETHER)
            self._add_way(t[part] - t[first], states[part])

    def _add_way(self, t: Array, states: Array) -> None:
        rate_terms, angle_terms = _integrals(t, states)
        n, (angle_noise, rate_noise) = len(t), self._noise
        terms = np.concatenate([rate_terms / rate_noise, angle_terms / angle_noise])
        seen = np.concatenate([states[:, 3] / rate_noise, states[:, 2] / angle_noise])
        begins = np.zeros((2 * n, 2))  # the angle and the rate at the beginning may be any
        begins[n:, 0] = 1.0 / angle_noise
        begins[:n, 1], begins[n:, 1] = 1.0 / rate_noise, t / angle_noise
        free = np.linalg.qr(begins)[0]
        terms, seen = terms - free @ (free.T @ terms), seen - free @ (free.T @ seen)
        self.gram += terms.T @ terms
        self.moment += terms.T @ seen
        self.squares += float(seen @ seen)
        self.equations += 2 * n - 2

    def fitted(self) -> tuple[Array, Array]:
        """Return the weights' mean (4, nodes), and L with L L' their covariance."""
        n = PARTS * NODES
        scale = np.repeat([1.0, 0.05, 0.3, 1.0], NODES)  # how far a weight may be from the line through its neighbours
        bend = np.kron(np.eye(PARTS), BEND.T @ BEND) / np.outer(scale, scale)
        prior = bend + 1e-4 * np.diag(1.0 / scale**2)
        mean = np.linalg.solve(self.gram + prior, self.moment)
        left = self.squares - 2.0 * float(mean @ self.moment) + float(mean @ self.gram @ mean)
        spread = max(1.0, left / max(1, self.equations))
        root = np.linalg.cholesky(self.gram / spread + prior)
        return np.asarray(mean.reshape(PARTS, NODES)), np.asarray(np.linalg.inv(root).T.reshape(PARTS, NODES, n))


def _integrals(t: Array, states: Array) -> tuple[Array, Array]:
    """Return single and double integrals of the model's terms up to each reading, along cubics through them.

    The cup's acceleration between two readings is that of its velocity, which is known.
    """
    n = len(t)
    single, double = np.zeros((n, PARTS, NODES)), np.zeros((n, PARTS, NODES))
    points, weights = np.polynomial.legendre.leggauss(4)
    points, weights = 0.5 * (points + 1.0), 0.5 * weights
    for k in range(1, n):
        h = t[k] - t[k - 1]
        (_, v0, angle0, rate0), (_, v1, angle1, rate1) = states[k - 1], states[k]
        cup = (v1 - v0) / h
        single[k] = single[k - 1]
        double[k] = double[k - 1] + h * single[k - 1]
        for s, weight in zip(points.tolist(), weights.tolist(), strict=True):
            s2, s3 = s * s, s * s * s
            angle = (2 * s3 - 3 * s2 + 1) * angle0 + (3 * s2 - 2 * s3) * angle1
            angle += h * ((s3 - 2 * s2 + s) * rate0 + (s3 - s2) * rate1)
            rate = (6 * s2 - 6 * s) * (angle0 - angle1) / h + (3 * s2 - 4 * s + 1) * rate0 + (3 * s2 - 2 * s) * rate1
            kernel.add_features(single[k], angle, rate, cup, weight * h)
            kernel.add_features(double[k], angle, rate, cup, weight * h * h * (1.0 - s))
    return single.reshape(n, -1), double.reshape(n, -1)
