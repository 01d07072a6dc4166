"""Smoothed positions and their derivatives, for the regressions that need f itself (docs/equations.md eq. 3)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.signal import fftconvolve, savgol_coeffs

from kendama_cli.motion.resampling import MIN_SAMPLES, TrimmedDemonstration
from kendama_cli.schema.arrays import Array


@dataclass(frozen=True)
class Derivatives:
    """Smoothed positions, and derivatives by s, at even shares (n,); arrays are (n, k) [m]."""

    share: Array
    position: Array
    rate: Array
    second: Array


def derivatives(demonstration: TrimmedDemonstration, smoothing_s: float) -> Derivatives:
    """Position and its derivatives by s, by local cubics (Savitzky-Golay) over ``smoothing_s`` of even samples."""
    n = len(demonstration.position_m)
    grid = np.linspace(0.0, 1.0, n)
    even = (
        demonstration.position_m
        if demonstration.even
        else np.asarray(CubicSpline(demonstration.share, demonstration.position_m, axis=0)(grid))
    )
    wanted = max(MIN_SAMPLES, 2 * round(smoothing_s / demonstration.duration_s * (n - 1) / 2) + 1)
    window = min(wanted, n if n % 2 else n - 1)
    return Derivatives(grid, *(_local_cubic(even, window, order, 1.0 / (n - 1)) for order in range(3)))


def _local_cubic(position: Array, window: int, order: int, step: float) -> Array:
    """The ``order``-th derivative of even samples (n, k); at the ends that of the first and last window's cubic.

    By fast convolution, so that the effort grows with the samples and hardly with the window.
    """
    kernel = savgol_coeffs(window, 3, deriv=order, delta=step)[:, None]
    made = fftconvolve(position, kernel, mode="same", axes=0)
    half = window // 2
    at = (np.arange(window) - half) * step
    for samples, ends in ((slice(0, window), slice(0, half)), (slice(-window, None), slice(-half, None))):
        cubic = np.polynomial.polynomial.polyfit(at, position[samples], 3)
        slope = np.polynomial.polynomial.polyder(cubic, order)
        made[samples][ends] = np.polynomial.polynomial.polyval(at[ends], slope).T
    return np.asarray(made)
