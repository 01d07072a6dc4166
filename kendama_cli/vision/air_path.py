"""What air does to a recorded flight, from its own velocity: paths without drag and spin are parabolas again."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from kendama_cli.schema.arrays import Array

DEGREE = 5
"""Of the polynomial whose derivative is a flight's velocity: drag and spin bend a parabola no more within a flight."""
SPIN_SIGMA_PER_S = 0.3
"""A spin before any flight was seen: a table-tennis ball at 6 m/s with 0.2 in lift coefficient has 0.35."""
NOISE_M = 2e-3
ROUNDS = 6


@dataclass(frozen=True)
class AirPath:
    """How far quadratic drag and spin have moved a ball, by their coefficients.

    With z'' = g - k |z'| z' + s x z' and z' known, z = z0 + z0' t + g t^2 / 2 - k Q + M s: Q is the second integral of
    |z'| z', ``drag_m2`` (n, 3) [m^2], and M that of the matrix of s -> s x z', ``spin_ms`` (n, 3, 3) [m s].
    """

    drag_m2: Array
    spin_ms: Array

    @staticmethod
    def along(t_s: Array, velocity_m_s: Array) -> AirPath:
        """The path with velocities (n, 3) at times (n,)."""
        speed = np.linalg.norm(velocity_m_s, axis=1, keepdims=True)
        x, y, z = velocity_m_s.T
        none = np.zeros_like(x)
        turned = np.array([[none, z, -y], [-z, none, x], [y, -x, none]]).transpose(2, 0, 1)
        both = np.concatenate([speed * velocity_m_s, turned.reshape(-1, 9)], axis=1)
        twice = _integral(t_s, _integral(t_s, both))
        return AirPath(twice[:, :3], twice[:, 3:].reshape(-1, 3, 3))

    @staticmethod
    def of_flight(t_s: Array, position_m: Array) -> AirPath:
        """The path of one free flight, smoothed."""
        length = float(t_s[-1] - t_s[0])
        s = (t_s - t_s[0]) / length
        order = min(DEGREE, max(len(t_s) // 4, 2))
        powers = np.arange(order + 1)
        weights = np.linalg.lstsq(s[:, None] ** powers, position_m, rcond=None)[0]
        slopes = powers[1:] * s[:, None] ** powers[:-1]
        return AirPath.along(t_s, slopes @ weights[1:] / length)

    @staticmethod
    def of_track(t_s: Array, position_m: Array) -> AirPath:
        """The path of a recorded track that does not fly all the time: velocities are differences."""
        return AirPath.along(t_s, np.gradient(position_m, t_s, axis=0))


@dataclass(frozen=True)
class Air:
    """Drag that flights have in common [1/m], each one's spin (f, 3) [1/s], and the spins' standard deviation."""

    drag_per_m: float
    spin_per_s: Array
    spin_sigma_per_s: float


def fit_air(flights: Sequence[tuple[Array, Array]], gravity_m_s2: Array, gravity_sigma_m_s2: float) -> Air:
    """Drag and spins of flights, each times (n,) and places (n, 3), by least squares about parabolas.

    Drag and what gravity differs by from ``gravity_m_s2`` are common to all; spins are normal about none. How large
    they are is estimated with them (expectation and maximisation), as is the noise.
    """
    sums, freedom = np.zeros((len(flights), 8, 8)), 0
    for i, (t_s, position_m) in enumerate(flights):
        path = AirPath.of_flight(t_s, position_m)
        free = np.linalg.qr(t_s[:, None] ** np.arange(2))[0]
        fall = t_s[:, None, None] ** 2 / 2 * np.eye(3)
        left = position_m - fall @ gravity_m_s2
        known = np.concatenate([path.spin_ms, -path.drag_m2[:, :, None], fall, left[:, :, None]], axis=2)
        rows = (known - np.einsum("nk,mk,mac->nac", free, free, known)).reshape(-1, 8)
        sums[i], freedom = rows.T @ rows, freedom + len(rows) - 9
    common, spins, sigma, noise = np.zeros(4), np.zeros((len(flights), 3)), SPIN_SIGMA_PER_S, NOISE_M
    for _ in range(ROUNDS):
        inner = np.linalg.inv(sums[:, :3, :3] + (noise / sigma) ** 2 * np.eye(3))
        left = (sums[:, 3:, 3:] - sums[:, 3:, :3] @ inner @ sums[:, :3, 3:]).sum(axis=0)
        left[1:4, 1:4] += (noise / gravity_sigma_m_s2) ** 2 * np.eye(3)
        common = np.linalg.solve(left[:4, :4], left[:4, 4])
        if common[0] < 0:
            common = np.array([0.0, *np.linalg.solve(left[1:4, 1:4], left[1:4, 4])])
        spins = np.einsum("fij,fj->fi", inner, sums[:, :3, 7] - sums[:, :3, 3:7] @ common)
        solution = np.column_stack([spins, np.tile([*common, -1.0], (len(spins), 1))])
        square = float(np.einsum("fi,fij,fj->", solution, sums, solution))
        noise = math.sqrt(max(square, 1e-12) / max(freedom, 1))
        spread = float((spins**2).sum() + noise**2 * np.trace(inner, axis1=1, axis2=2).sum())
        sigma = math.sqrt((spread + SPIN_SIGMA_PER_S**2) / (3 * len(spins) + 1))
    return Air(float(common[0]), spins, sigma)


def _integral(t_s: Array, values: Array) -> Array:
    steps = np.diff(t_s)[:, None] * (values[1:] + values[:-1]) / 2
    return np.concatenate([np.zeros_like(values[:1]), np.cumsum(steps, axis=0)])
