"""The phase of a movement primitive, and Gaussian basis functions in it with the features that they make (eq. 4, 5)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from kendama_cli.schema.arrays import Array


def phase(share: Array, decay: float) -> Array:
    """Return x = exp(-alpha s), the solution of x' = -alpha x / tau with x(0) = 1 (equations.md eq. 4).

    ``share`` s = t / tau (n,) is the part of the motion that has passed, ``decay`` is alpha. Returns (n,).
    """
    return np.exp(-decay * np.asarray(share, dtype=np.float64))


@dataclass(frozen=True)
class Basis:
    """Properties that a primitive has in common with those it is averaged with: M ``functions``, K, alpha, ``width``
    over
    spacing.
    """

    functions: int
    stiffness: float
    decay: float
    width: float

    @property
    def frequency(self) -> float:
        """w = sqrt K, in units of 1 / tau."""
        return float(np.sqrt(self.stiffness))

    @property
    def centers(self) -> Array:
        """c_j (m,)."""
        return centers_equal_in_time(self.functions, self.decay)

    @property
    def widths(self) -> Array:
        """s_j (m,)."""
        return widths_by_spacing(self.centers, self.width)

    def features(self, share: Array) -> Array:
        """Return the features (n, m) at fractions s of the motion (n,)."""
        return features(phase(share, self.decay), self.centers, self.widths)


def centers_equal_in_time(count: int, decay: float) -> Array:
    """Return c_j = x(s_j) for ``count`` times s_j spread evenly from the start to the end of the motion; (m,),
    falling.
    """
    return phase(np.linspace(0.0, 1.0, count), decay)


def widths_by_spacing(centers: Array, factor: float) -> Array:
    """Return s_j = ``factor`` times the distance of centre j to its neighbour (the last one's to the one before
    it); (m,).
    """
    gaps = np.abs(np.diff(centers))
    made: Array = factor * np.append(gaps, gaps[-1])
    return made


def activations(x: Array, centers: Array, widths: Array) -> Array:
    """Return psi_j(x) = exp(-(x - c_j)^2 / (2 s_j^2)) (equations.md eq. 5) for phases ``x`` (n,); (n, m).

    Several sets of ``widths`` (w, m) take ``x`` as (n, 1); returns (n, w, m).
    """
    distance = (np.asarray(x)[..., None] - centers) / widths
    made: Array = np.exp(-0.5 * distance**2)
    return made


def features(x: Array, centers: Array, widths: Array) -> Array:
    """Return x psi_j(x) / sum_k psi_k(x), f = features @ weights (equations.md eq. 5); shapes as
    ``activations``.
    """
    psi = activations(x, centers, widths)
    made: Array = np.asarray(x)[..., None] * psi / psi.sum(axis=-1, keepdims=True)
    return made


def feature_rates(x: Array, centers: Array, widths: Array, decay: float) -> Array:
    """Return d features / ds, with dx/ds = -``decay`` x; shapes as ``activations``."""
    psi = activations(x, centers, widths)
    x = np.asarray(x)[..., None]
    total = psi.sum(axis=-1, keepdims=True)
    slope = (centers - x) / widths**2 * psi
    by_x = (psi + x * slope) / total - x * psi * slope.sum(axis=-1, keepdims=True) / total**2
    return np.asarray(-decay * x * by_x)
