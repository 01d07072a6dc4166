"""The moving part of a recording: by integrals and roots of what was sampled, and cut where it says."""

from __future__ import annotations

import math

import numpy as np
import pytest

from kendama_cli.motion.dmp.onset import (
    REST_WINDOW_SHARE,
    Moving,
    SmoothSpeed,
    between,
    between_samples_m,
    common_margins,
    cut,
    is_even,
    moving_part,
)
from kendama_cli.schema.arrays import Array
from tests.motion.swings import path

RNG = np.random.default_rng(10000)
EVEN = np.arange(1201) / 400
UNEVEN = EVEN + 1e-3 * np.append(np.append(0.0, RNG.uniform(-1.0, 1.0, 1199)), 0.0)


def hand(t_s: Array) -> Array:
    return path(t_s - 0.6, 1.7)


@pytest.mark.parametrize(("t_s", "window_s"), [(EVEN, 0.3), (UNEVEN, 0.3), (EVEN, 1e-6), (EVEN, 9.0)])
def test_the_speed_is_the_mean_of_the_next_half_window_less_that_of_the_last(t_s: Array, window_s: float) -> None:
    """Each half is two samples long at least, and half of the recording at most."""
    half = min(max(window_s / 2, 2 * 3.0 / 1200), 1.5)
    made = SmoothSpeed(t_s, hand(t_s) + np.array([5.0, 0.0, -3.0])).over(window_s)
    for k in range(0, 1201, 60):
        at = min(max(t_s[k], half), 3.0 - half)
        past, ahead = (hand(at + half * (np.arange(200) + 0.5) / 200 + shift).mean(axis=0) for shift in (-half, 0.0))
        # what straight lines between samples leave of the integrals
        assert made[k] == pytest.approx(np.linalg.norm(ahead - past) / half, abs=2e-3)


@pytest.mark.parametrize("t_s", [EVEN, UNEVEN], ids=["even", "uneven"])
@pytest.mark.parametrize(("rest_m_s", "rest_fraction"), [(0.05, 0.01), (0.01, 0.2)])
def test_the_part_that_moves_is_between_the_first_and_last_crossing_of_rest(
    t_s: Array, rest_m_s: float, rest_fraction: float
) -> None:
    found = moving_part(t_s, hand(t_s), rest_speed_m_s=rest_m_s, rest_fraction=rest_fraction)
    rest = max(rest_m_s, rest_fraction * found.speed_m_s.max())
    assert found.rest_m_s == rest
    assert np.interp([found.begin_s, found.end_s], t_s, found.speed_m_s) == pytest.approx(rest, abs=1e-12)
    assert found.speed_m_s[(t_s < found.begin_s) | (t_s > found.end_s)].max() <= rest
    # its window is a tenth of itself
    again = SmoothSpeed(t_s, hand(t_s)).over(REST_WINDOW_SHARE * (found.end_s - found.begin_s))
    assert found.speed_m_s == pytest.approx(again, abs=1e-6)
    assert found.even == is_even(t_s) == (t_s is EVEN)


def test_a_recording_that_moves_from_end_to_end_is_all_of_the_part() -> None:
    t_s = EVEN[500:600]
    found = moving_part(t_s, hand(t_s), rest_speed_m_s=0.02, rest_fraction=0.05)
    assert (found.begin_s, found.end_s) == (t_s[0], t_s[-1])
    slow = moving_part(t_s, 0.05 * np.sin(t_s)[:, None], rest_speed_m_s=0.01, rest_fraction=0.05)
    with pytest.raises(ValueError, match=r"faster than 0\.05 m/s \(peak 0\.0"):
        moving_part(t_s, 0.05 * np.sin(t_s)[:, None], rest_speed_m_s=0.05, rest_fraction=0.05)
    assert slow.rest_m_s == 0.01


def test_samples_are_even_to_a_millionth_of_a_step() -> None:
    t_s = 7.0 + np.arange(300) / 100
    for off, even in ((0.4e-8, True), (0.8e-8, False)):
        assert is_even(t_s + off * (np.arange(300) == 150)) == even


def parted(t_s: Array, *, rest_m_s: float = 0.1) -> Moving:
    """A part from 0.905 to 2.105 s on, whose speed rises and falls by 1 m/s^2 about 0.1 m/s at its ends."""
    begin_s, end_s = t_s[0] + 0.905, t_s[0] + 2.105
    speed = 0.1 + np.minimum(t_s - begin_s, end_s - t_s)
    return Moving(begin_s, end_s, is_even(t_s), t_s, speed, rest_m_s)


@pytest.mark.parametrize(
    ("head", "tail", "begin_s", "end_s"), [(0.1, 0.25, 4.785, 6.405), (9.0, 9.0, 4.0, 7.0), (None, None, 4.0, 7.0)]
)
@pytest.mark.parametrize("even", [True, False])
def test_a_part_is_cut_at_its_margins_and_no_farther_than_it_was_seen(
    head: float | None, tail: float | None, begin_s: float, end_s: float, even: bool
) -> None:
    t_s = 4.0 + (EVEN if even else UNEVEN)
    made = cut(t_s, hand(t_s - 4.0), parted(t_s), head, tail)
    assert made.onset_s == pytest.approx(begin_s)
    assert made.duration_s == pytest.approx(end_s - begin_s)
    if even:
        assert made.even
        assert made.t_s == pytest.approx(np.linspace(begin_s, end_s, round(400 * (end_s - begin_s)) + 1))
    else:
        inner = t_s[(t_s > begin_s + 1e-9) & (t_s < end_s - 1e-9)]
        assert made.t_s == pytest.approx(np.concatenate([[begin_s], inner, [end_s]]), abs=1e-12)
        assert not made.even
        assert made.share == pytest.approx((made.t_s - begin_s) / (end_s - begin_s))
    assert made.position_m == pytest.approx(hand(made.t_s - 4.0) - hand(made.t_s[:1] - 4.0), abs=1e-6)
    assert (made.starts_still, made.ends_still) == (begin_s < 4.825, end_s > 6.185)
    assert not made.starts_fast
    assert not made.ends_fast


@pytest.mark.parametrize(
    ("rest_m_s", "still", "fast"), [(0.1, False, False), (0.0999, False, True), (0.6, True, False)]
)
def test_an_end_is_still_below_a_fifth_of_rest_and_fast_above_it(rest_m_s: float, still: bool, fast: bool) -> None:
    made = cut(EVEN, hand(EVEN), parted(EVEN, rest_m_s=rest_m_s), 0.0, 0.0)
    assert (made.starts_still, made.ends_still, made.starts_fast, made.ends_fast) == (still, still, fast, fast)


def test_too_few_samples_and_too_long_gaps_are_told() -> None:
    t_s = np.arange(16) / 5  # 0.905 to 2.105 s holds six
    assert len(cut(t_s, hand(t_s), parted(t_s), 0.0, 0.0).share) == 7
    with pytest.raises(ValueError, match="only 4 samples move; a swing needs at least 5"):
        cut(t_s[::2], hand(t_s[::2]), parted(t_s[::2]), 0.2, 0.2)
    for lost, refused in ((46, False), (51, True)):  # of 480 steps in 1.2 s, a tenth
        gap = np.delete(EVEN, 500 + np.arange(lost))
        if refused:
            with pytest.raises(ValueError, match=rf"after sample 500 nothing is known for {(lost + 1) / 400:.3g} s of"):
                cut(gap, hand(gap), parted(gap), 0.0, 0.0)
        else:
            assert not cut(gap, hand(gap), parted(gap), 0.0, 0.0).even
    few = np.delete(t_s, 6)  # one of so few is a low rate: 0.4 s of 3
    assert len(cut(few, hand(few), parted(few), None, None).share) == 15


def test_a_cubic_between_samples_is_off_by_the_fourth_derivative() -> None:
    """(3 / 128) h^4 p'''' midway, here of t^4 / 2 and -t^4 along two axes; cubics come back as they are."""
    t_s = np.arange(40) * 0.05
    assert between_samples_m(np.outer(t_s**4, [0.5, -1.0, 0.0])) == pytest.approx(
        3 / 128 * 0.05**4 * 24 * math.hypot(0.5, 1.0)
    )
    assert between_samples_m((t_s**3 - t_s)[:, None]) == pytest.approx(0.0, abs=1e-15)
    at_s = np.array([0.013, 1.111])
    assert between(t_s, np.outer(t_s**3, [1.0, -2.0]), at_s) == pytest.approx(np.outer(at_s**3, [1.0, -2.0]))


def test_margins_are_those_that_all_have() -> None:
    long, short = parted(EVEN), Moving(0.5, 2.9, True, EVEN, EVEN, 0.1)
    assert common_margins([EVEN, EVEN], [long, short], 0.9) == pytest.approx((0.5 / 2.4, 0.1 / 2.4))
    assert common_margins([EVEN, EVEN], [long, long], 0.7) == pytest.approx((0.7, 0.7))
    assert common_margins([EVEN + 0.2, EVEN], [long, long], 2.0) == pytest.approx((0.705 / 1.2, 0.895 / 1.2))
