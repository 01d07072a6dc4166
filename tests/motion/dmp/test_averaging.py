from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from kendama_cli.artifacts.demonstration import Demonstration
from kendama_cli.motion.dmp.averaging import apart, axes_of, encode, encode_demonstrations, prepare
from kendama_cli.motion.dmp.primitive import play
from kendama_cli.schema.arrays import Array
from tests.motion.swings import demonstration, path, settings


def encoded(demonstrations, chosen=None):
    chosen = chosen or settings()
    return encode(prepare(demonstrations, chosen), chosen)


def test_the_average_of_one_is_itself():
    made = encoded([demonstration(), demonstration(2.3)])
    assert np.array_equal(made.average([1]).weights, made.plan(1).weights)
    assert made.average([1]).duration_s == made.plan(1).duration_s


def test_the_average_plays_the_average_of_the_motions():
    """y is linear in goal, end rates and weights, so averaging parameters averages the paths at equal shares."""
    made = [demonstration(1.8), demonstration(2.3), demonstration(2.0)]
    t = np.arange(0.5, 1.5, 0.01)
    made.append(Demonstration("moving", t, path(t)))
    encoding = encoded(made)
    mean = encoding.average()
    fraction = np.linspace(0, 1, 50)
    plans = [encoding.plan(i) for i in range(4)]
    paths = [play(plan, fraction * plan.duration_s).position_m for plan in plans]
    assert np.abs(play(mean, fraction * mean.duration_s).position_m - np.mean(paths, axis=0)).max() < 1e-12


def test_demonstrations_of_other_place_rate_duration_and_rest_average_to_the_same_swing():
    shifted = demonstration(rate_hz=250, head_s=0.7, tail_s=1.1)
    shifted = dataclasses.replace(shifted, position_m=shifted.position_m + np.array([3.0, -1.0, 0.2]))
    mean = encode_demonstrations([demonstration(1.8, rate_hz=120), shifted, demonstration(2.2, head_s=0.4)], settings())
    alone = encode_demonstrations([demonstration(2.0, head_s=0.3, tail_s=0.3)], settings())
    fraction = np.linspace(0, 1, 100)
    difference = play(mean, fraction * mean.duration_s).position_m - play(alone, fraction * alone.duration_s).position_m
    # a sample of 10 ms would be 10 mm of a swing of 1 m/s
    assert np.abs(difference).max() < 1e-3


@pytest.mark.parametrize(("rate_hz", "agree_m"), [(60, 3e-3), (100, 1e-3), (1000, 1e-4)])
def test_one_path_shown_faster_and_slower_gives_one_primitive(rate_hz, agree_m):
    """At equal shares of a motion of 0.8, 1 and 1.3 s: its ends are found between samples, by a window of its own."""
    fraction = np.linspace(0, 1, 200)
    swings = [demonstration(duration, rate_hz, head_s=0.3, tail_s=0.3) for duration in (0.8, 1.0, 1.3)]
    trimmed = [prepare([one], settings())[0] for one in swings]
    cut = [one.duration_s / duration for one, duration in zip(trimmed, (0.8, 1.0, 1.3), strict=True)]
    assert cut == pytest.approx([cut[0]] * 3, abs=0.5 / rate_hz)
    plans = [encode_demonstrations([one], settings()) for one in swings]
    paths = np.array([play(plan, fraction * plan.duration_s).position_m for plan in plans])
    assert np.linalg.norm(paths - paths[1], axis=2).max() < agree_m


def test_the_rest_that_is_kept_is_the_same_share_of_every_motion():
    """Else the motions would begin at different shares, and their average would blur."""
    pair = [demonstration(1.8, 500, head_s=0.5), demonstration(2.3, 500, head_s=0.5, tail_s=1.0)]
    onset = [np.searchsorted(np.abs(one.position_m[:, 0]), 0.02) / len(one.share) for one in prepare(pair, settings())]
    assert onset[0] == pytest.approx(onset[1], abs=2e-3)  # a sample


def test_where_one_has_no_rest_none_keeps_any():
    t = np.arange(0.6, 2.2, 0.01)
    cut = Demonstration("cut", t, path(t))
    with_rest = prepare([demonstration(head_s=0.5)], settings())[0]
    beside = prepare([demonstration(head_s=0.5), cut], settings())[0]
    assert beside.onset_s > with_rest.onset_s
    assert prepare([demonstration(head_s=0.5), cut], settings())[1].onset_s == t[0]


def test_averaging_takes_out_what_is_not_common():
    """Ten swings with independent errors of 5 mm: the average is nearer to the truth than every one of them."""
    rng = np.random.default_rng(11)
    truth = demonstration()
    fraction = truth.t_s / 2.0
    noisy = []
    for i in range(10):
        error = sum(
            rng.normal(0, 5e-3, 3) * np.sin(np.pi * fraction[:, None]) * np.sin(np.pi * k * fraction[:, None])
            for k in (1, 2, 3)
        )
        noisy.append(Demonstration(f"n{i}", truth.t_s, truth.position_m + error))
    chosen = settings(trim="none")
    fraction = np.linspace(0, 1, 100)
    clean = play(encode_demonstrations([truth], chosen), 2.0 * fraction).position_m

    def distance(plan):
        return np.sqrt(np.mean((play(plan, plan.duration_s * fraction).position_m - clean) ** 2))

    encoding = encoded(noisy, chosen)
    assert distance(encoding.average()) < min(distance(encoding.plan(i)) for i in range(10))


def test_there_are_22_parameters_per_coordinate():
    assert encode_demonstrations([demonstration()], settings()).n_parameters == 22


def test_resting_ends_are_cut_to_the_margin():
    (swing,) = prepare([demonstration(head_s=1.0, tail_s=2.0)], settings())
    # the formula itself rests for the first 0.1 and the last 0.1 of its 2 s, and starts slowly
    assert 1.5 < swing.duration_s < 2.0
    assert 1.1 < swing.onset_s < 1.25


def test_without_trimming_all_rows_stay():
    (swing,) = prepare([demonstration(head_s=1.0, tail_s=2.0)], settings(trim="none"))
    assert swing.duration_s == pytest.approx(5.0)


def test_a_hand_that_never_moves_is_named():
    still = Demonstration("nap", np.arange(50) / 100, np.zeros((50, 3)))
    with pytest.raises(ValueError, match=r"demonstration 'nap': the hand never moves faster than 0.02 m/s"):
        prepare([still], settings())


def test_a_swing_of_too_few_samples_is_named():
    short = Demonstration("blink", np.arange(4) / 100, np.arange(12.0).reshape(4, 3))
    with pytest.raises(ValueError, match=r"demonstration 'blink': a demonstration needs at least 5 samples, not 4"):
        prepare([short], settings())


def test_noise_does_not_hide_where_the_motion_begins():
    """1 mm of white noise at 100 Hz is 0.14 m/s from sample to sample; rest is still told from motion."""
    clean = demonstration(head_s=1.5, tail_s=1.5)
    (truth,) = prepare([clean], settings())
    rng = np.random.default_rng(8)
    for _ in range(10):
        noisy = Demonstration("noisy", clean.t_s, clean.position_m + rng.normal(0, 1e-3, clean.position_m.shape))
        (swing,) = prepare([noisy], settings())
        assert abs(swing.onset_s - truth.onset_s) < 0.05
        assert abs(swing.duration_s - truth.duration_s) < 0.08
        plan = encode_demonstrations([noisy], settings())
        assert not plan.start_velocity_m_s.any()
        assert not plan.goal_velocity_m_s.any()


T = np.linspace(0, 2, 101)


def swings(count: int, seed: int, spread: float = 0.05) -> Array:
    rng = np.random.default_rng(seed)
    return np.array([(1 + spread * rng.standard_normal(3)) * (path(T) - path(T)[0]) for _ in range(count)])


@pytest.mark.parametrize("count", [4, 6, 10, 20])
def test_alike_demonstrations_are_all_kept(count: int) -> None:
    """200 sets: less than one demonstration in a hundred is taken for an outlier (measured: none of 12 000)."""
    counts = [apart(swings(count, seed), np.full(count, 2.0)).sum() for seed in range(200)]
    assert np.mean(counts) / count < 0.01


def test_a_swing_of_another_kind_stands_apart_and_only_it() -> None:
    paths = swings(10, 1)
    paths[4, :, 2] += 0.2 * np.sin(2 * np.pi * T)
    assert list(np.flatnonzero(apart(paths, np.full(10, 2.0)))) == [4]


def test_a_swing_of_twice_the_duration_stands_apart() -> None:
    durations = np.array([2.0, 2.1, 1.9, 2.05, 4.0, 1.95])
    assert list(np.flatnonzero(apart(swings(6, 2), durations))) == [4]


@pytest.mark.parametrize(("times", "is_apart"), [(0.8, False), (1.25, True)])
def test_an_outlier_is_three_and_a_half_deviations_away_and_more_in_a_small_set(times: float, is_apart: bool) -> None:
    """Nine durations at steps of 0.05 about the median, and one farther off: logarithms, median distance 0.125.

    0.125 * 1.4826 is the standard deviation of a normal distribution with that median distance; with ten 40 % more.
    """
    limit = 3.5 * (1 + 4 / 10) * 1.4826 * 0.125
    lengths = np.array([-0.2, -0.15, -0.1, -0.05, 0.0, 0.05, 0.1, 0.15, 0.2])
    median = 0.025  # of the nine and the one above them all
    durations = 2.0 * np.exp(np.append(lengths, median + times * limit))
    assert list(apart(swings(10, 3), durations)) == [False] * 9 + [is_apart]


def test_differences_of_a_millimetre_are_nobodys_fault() -> None:
    paths = np.repeat(swings(1, 3), 6, axis=0)
    paths[2] += 1e-3 * np.sin(5 * T)[:, None]
    assert not apart(paths, np.full(6, 2.0)).any()


def test_of_three_nobody_stands_apart() -> None:
    paths = swings(3, 4)
    paths[0] *= -1
    assert not apart(paths, np.full(3, 2.0)).any()


@pytest.mark.parametrize(
    ("read", "sentence"),
    [
        (lambda p: p * [-1, 1, 1], "x is its -x"),
        (lambda p: p[:, [2, 1, 0]], "x is its z, z is its x"),
        (lambda p: p[:, [1, 0, 2]], "x is its y"),
        (lambda p: p[:, [1, 2, 0]] * [1, -1, 1], "x is its z, z is its -y"),
    ],
)
def test_other_axes_are_recognised_and_named(read, sentence) -> None:  # type: ignore[no-untyped-def]
    paths = swings(6, 5)
    found = axes_of(read(paths[0]), list(paths[1:]), "xyz")
    assert found == sentence


@pytest.mark.parametrize(("size", "sentence"), [(0.045, "x is its -x, y is its -y"), (0.02, "x is its -x")])
def test_an_axis_along_which_nobody_moves_has_no_sign(size: float, sentence: str) -> None:
    """The largest axis is a short push, of rms 0.3 times its peak; still is what moves by less than a tenth of that."""
    push = np.exp(-(((T - 1.0) / 0.1) ** 2))
    wave = np.sqrt(2) * np.sin(4 * np.pi * T)
    others = np.column_stack([push, size * wave, 0.2 * np.cos(3 * np.pi * T)])
    assert axes_of(others * [-1, -1, 1], [others] * 5, "xyz") == sentence


def test_axes_that_agree_and_swings_of_another_kind_are_left_alone() -> None:
    paths = swings(6, 6)
    assert axes_of(paths[0], list(paths[1:]), "xyz") is None
    other = 0.3 * np.column_stack([np.sin(9 * T), 0 * T, np.cos(13 * T)])
    assert axes_of(other, list(paths[1:]), "xyz") is None


def test_where_the_others_do_not_agree_nobody_is_told_about_axes() -> None:
    paths = swings(3, 7)
    paths[1] *= -1
    assert axes_of(-paths[0], [*paths], "xyz") is None
