"""Probabilities of an image's peaks, of which one at most is the ball."""

import numpy as np
import pytest

from kendama_cli.plugins.films.trained_detector import TEMPERATURE, peak_scores

LOG_ODDS = np.array([6.0, 5.0, -2.0, 9.0, 0.5])


def test_scores_are_those_of_one_peak_or_none():
    odds = np.exp(LOG_ODDS / TEMPERATURE)
    assert peak_scores(LOG_ODDS) == pytest.approx(odds / (1 + odds.sum()), rel=1e-12)


def test_peaks_share_their_probability():
    assert peak_scores(np.full(4, 30.0)) == pytest.approx(0.25, rel=1e-3)


def test_no_peaks_have_no_scores():
    assert peak_scores(np.array([])).shape == (0,)


def test_the_surest_peaks_have_finite_scores():
    assert peak_scores(np.full(60, 1e4)) == pytest.approx(1 / 60, rel=1e-3)
