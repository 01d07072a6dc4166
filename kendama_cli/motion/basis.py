"""Gaussian basis functions in phase and the features that they make (PAPER.md eq. 5)."""

from __future__ import annotations

import numpy as np

from kendama_cli.artifacts.checks import Array
from kendama_cli.motion.phase import phase


def centers_equal_in_time(count: int, decay: float) -> Array:
    """c_j = x(s_j) for ``count`` instants s_j spread evenly from the start to the end of the motion; (m,), falling."""
    return phase(np.linspace(0.0, 1.0, count), decay)


def widths_by_spacing(centers: Array, factor: float) -> Array:
    """s_j = ``factor`` times the distance of centre j to its neighbour (the last one's to the one before it); (m,)."""
    gaps = np.abs(np.diff(centers))
    made: Array = factor * np.append(gaps, gaps[-1])
    return made


def activations(x: Array, centers: Array, widths: Array) -> Array:
    """psi_j(x) = exp(-(x - c_j)^2 / (2 s_j^2)) (PAPER.md eq. 5) for phases ``x`` (n,); returns (n, m)."""
    distance = (np.asarray(x)[:, None] - centers) / widths
    made: Array = np.exp(-0.5 * distance**2)
    return made


def features(x: Array, centers: Array, widths: Array) -> Array:
    """x psi_j(x) / sum_k psi_k(x), so that f = features @ weights (PAPER.md eq. 5); returns (n, m)."""
    psi = activations(x, centers, widths)
    made: Array = np.asarray(x)[:, None] * psi / psi.sum(axis=1, keepdims=True)
    return made
