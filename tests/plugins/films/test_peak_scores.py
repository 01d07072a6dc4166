"""Probabilities of an image's peaks, given the number of balls it shows at most."""

from itertools import combinations

import numpy as np
import pytest

from kendama_cli.plugins.films.trained_detector import TEMPERATURE, peak_scores

LOG_ODDS = np.array([6.0, 5.0, -2.0, 9.0, 0.5])


@pytest.mark.parametrize("balls", [1, 2, 3, 5, 9])
def test_scores_are_those_of_all_sets_of_peaks_that_are_possible(balls):
    odds = np.exp(LOG_ODDS / TEMPERATURE)
    weight, shows = 0.0, np.zeros(len(odds))
    for size in range(min(balls, len(odds)) + 1):
        for chosen in combinations(range(len(odds)), size):
            weight += np.prod(odds[list(chosen)])
            shows[list(chosen)] += np.prod(odds[list(chosen)])
    assert peak_scores(LOG_ODDS, balls) == pytest.approx(shows / weight, rel=1e-12)


def test_peaks_share_their_probability_where_there_are_fewer_balls():
    scores = peak_scores(np.full(4, 30.0), 1)
    assert scores == pytest.approx(0.25, rel=1e-3)
    assert peak_scores(np.full(4, 30.0), 4) == pytest.approx(1 / (1 + np.exp(-30 / TEMPERATURE)))


def test_no_peaks_have_no_scores():
    assert peak_scores(np.array([]), 1).shape == (0,)


def test_the_surest_peaks_have_finite_scores():
    assert peak_scores(np.full(60, 1e4), 20) == pytest.approx(1 / 3, rel=1e-3)
