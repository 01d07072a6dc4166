"""How probable each of an image's peaks is, given how many balls the image shows at most."""

from __future__ import annotations

import numpy as np

from kendama_cli.schema.arrays import Array

TEMPERATURE = 3.0
"""A classifier that has seen a few boxes is too sure: its log odds are divided by this."""
MOST_LOG_ODDS = 60.0
"""More is no surer, and products of odds stay finite."""


def peak_scores(log_odds: Array, balls: int) -> Array:
    """Probabilities (n,) that peaks with ``log_odds`` (n,) show a ball, where an image shows ``balls`` at most.

    Each peak by itself would show one with odds o_i = exp(log odds / TEMPERATURE). Of all sets S of peaks those of no
    more than ``balls`` are possible, each with a weight of prod_{i in S} o_i:

        p_i = o_i e(o without o_i, balls - 1) / e(o, balls),   e(o, m) = sum_{|S| <= m} prod_{i in S} o_i

    For one ball that is o_i / (1 + sum_j o_j); for as many balls as peaks, o_i / (1 + o_i). What resembles the ball and
    was not in the taught images (a checked shirt) has many peaks, the ball has one.
    """
    odds = np.exp(np.minimum(log_odds, MOST_LOG_ODDS) / TEMPERATURE)
    possible = _sets(odds, balls)
    some = [odd * _sets(np.delete(odds, i), balls - 1) / possible for i, odd in enumerate(odds)]
    return np.array(some, dtype=np.float64)


def _sets(odds: Array, most: int) -> float:
    """e(odds, most): the sum of the elementary symmetric polynomials of degree 0 to ``most``."""
    by_size = np.zeros(most + 1)
    by_size[0] = 1
    for odd in odds:
        by_size[1:] += odd * by_size[:-1]
    return float(by_size.sum())
