"""Path of the cup from samples of the hand."""

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from kendama_cli.plugins.teleoperation.play.hand_path import HandPath

SMOOTHING_S = 0.007


def follow(t_s, places, cuts=()):
    path = HandPath(SMOOTHING_S, np.zeros(places.shape[1]))
    samples = list(zip(t_s.tolist(), places, strict=True))
    edges = [0, *sorted(cuts), len(samples)]
    parts = [path.follow(samples[a:b]) for a, b in itertools.pairwise(edges) if b > a]
    return path, np.concatenate(parts)


@given(st.lists(st.integers(1, 99), max_size=8))
@settings(max_examples=40, deadline=None)
def test_how_samples_are_packed_into_messages_changes_nothing(cuts):
    rng = np.random.default_rng(10001)
    t_s = np.cumsum(rng.uniform(0.001, 0.02, 100))
    places = np.cumsum(rng.normal(0, 0.01, (100, 3)), axis=0)
    whole = follow(t_s, places)[1]
    assert np.array_equal(follow(t_s, places, cuts)[1], whole)
    assert len(whole) == int(t_s[-1] * 1000 + 1e-3)


@pytest.mark.parametrize("rate_hz", [60, 125, 250, 1000])
def test_the_cup_is_where_the_hand_was_a_fixed_time_ago(rate_hz):
    # a swing's hardest motion, 0.15 m at 1.8 Hz: 19 m/s^2; lines between samples of 60 Hz alone cut 0.7 mm
    t_s = np.arange(0, 2, 1 / rate_hz)
    hand = lambda t: 0.15 * (1 - np.cos(2 * np.pi * 1.8 * np.maximum(t, 0)))  # noqa: E731
    path, cup = follow(t_s, hand(t_s)[:, None])
    steps_s = 0.001 * np.arange(1, len(cup) + 1)
    error_m = np.abs(cup[:, 0] - hand(steps_s - path.delay_s))
    assert error_m.max() < (0.8e-3 if rate_hz == 60 else 0.35e-3)
    assert path.delay_s == pytest.approx(SMOOTHING_S)


def test_pixels_are_smoothed_away():
    t_s = np.arange(0, 2, 0.008)
    hand = 0.15 * (1 - np.cos(2 * np.pi * t_s))
    pixel_m = 0.002
    rough_m_s2 = np.abs(np.diff(np.round(hand / pixel_m) * pixel_m, 2)).max() / 0.008**2
    _, smooth = follow(t_s, (np.round(hand / pixel_m) * pixel_m)[:, None])
    _, exact = follow(t_s, hand[:, None])
    assert rough_m_s2 > 25
    assert np.abs(smooth - exact).max() <= pixel_m / 2 + 1e-9


def test_a_sample_from_the_past_counts_as_one_of_now():
    path = HandPath(SMOOTHING_S, np.zeros(1))
    assert len(path.follow([(0.1, np.ones(1))])) == 100
    assert len(path.follow([(0.05, np.ones(1))])) == 0
    assert path.t_s == 0.1
