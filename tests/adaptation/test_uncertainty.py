from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from scipy.stats import binom

from kendama_cli.adaptation.settings import UncertaintySettings
from kendama_cli.adaptation.uncertainty import (
    Repeat,
    drawn_errors,
    expected_success,
    judging_errors,
    needed_m,
)
from kendama_cli.artifacts.proportion import success_interval
from kendama_cli.errors import ConfigError
from kendama_cli.schema.settings import build
from kendama_cli.simulation.dart.world_errors import WorldErrors
from tests.shipped_conf import plain

MOUTH_M = 0.038


def _preset(name: str) -> UncertaintySettings:
    return build(UncertaintySettings, plain("adapt/uncertainty", name), "uncertainty")


def _repeats(misses: np.ndarray) -> list[Repeat]:
    return [Repeat(bool(abs(one) < MOUTH_M), float(one)) for one in misses]


@pytest.mark.parametrize(("middle_m", "spread_m"), [(0.0, 0.01), (0.02, 0.01), (0.0, 0.04), (0.03, 0.02), (0.08, 0.01)])
def test_the_expected_success_is_the_share_of_worlds_that_are_caught(middle_m: float, spread_m: float) -> None:
    """Over 400 judgements by 12 worlds each: within 0.06 on average, one by one as near as counting, or nearer."""
    rng = np.random.default_rng(10000)
    true = float(np.mean(np.abs(rng.normal(middle_m, spread_m, 200_000)) < MOUTH_M))
    judged = [_repeats(rng.normal(middle_m, spread_m, 12)) for _ in range(400)]
    expected = np.array([expected_success(one, MOUTH_M) for one in judged])
    counted = np.array([np.mean([repeat.caught for repeat in one]) for one in judged])
    assert expected.mean() == pytest.approx(true, abs=0.06)
    assert np.mean((expected - true) ** 2) <= 1.2 * np.mean((counted - true) ** 2) + 1e-4


def test_a_few_lost_worlds_far_off_count_as_what_they_are() -> None:
    """A seen catch comes down in the middle, or far away: two of twelve are two of twelve."""
    misses = np.array([0.001, -0.002, 0.0, 0.003, 0.001, -0.001, 0.002, 0.0, -0.003, 0.001, 0.2, -0.15])
    assert expected_success(_repeats(misses), MOUTH_M) == pytest.approx(10 / 12, abs=1e-3)


def test_balls_that_jumped_out_and_balls_that_never_came_down_are_lost() -> None:
    good = [Repeat(True, 0.0)] * 4
    assert expected_success(good, MOUTH_M) == pytest.approx(1.0)
    assert expected_success([*good[:3], Repeat(False, 0.0)], MOUTH_M) == pytest.approx(0.75)
    assert expected_success([*good[:3], Repeat(False, None)], MOUTH_M) == pytest.approx(0.75)
    assert expected_success([Repeat(False, None)] * 4, MOUTH_M) == 0.0
    assert needed_m([Repeat(True, -0.01, 0.03), Repeat(False, None)]) == pytest.approx(0.52)


def test_the_worlds_that_judge_cover_every_quarter_of_every_range_and_are_the_same_again() -> None:
    shipped = _preset("hard")
    worlds = [judging_errors(shipped, 0.4, index, 10000) for index in range(12)]
    assert worlds == [judging_errors(shipped, 0.4, index, 10000) for index in range(12)]
    assert worlds != [judging_errors(shipped, 0.4, index, 10001) for index in range(12)]
    for first in (0, 4, 8):
        block = worlds[first : first + 4]
        for values, (low, high) in (
            ([one.world.rope_scale for one in block], (0.995, 1.005)),
            ([one.world.restitution or 0.0 for one in block], shipped.restitution),
            ([one.arm.lag_s for one in block], shipped.lag_s),
            ([one.arm.cup_error_phase_rad for one in block], (0.0, 2 * np.pi)),
        ):
            assert sorted(int(4 * (value - low) / (high - low)) for value in values) == [0, 1, 2, 3]


@pytest.mark.parametrize("preset", ["hard", "identified"])
def test_every_draw_is_within_what_is_declared(preset: str) -> None:
    shipped = _preset(preset)
    rng = np.random.default_rng(0)
    draws = [drawn_errors(shipped, 0.4, rng) for _ in range(500)]
    assert all(0.995 <= one.world.rope_scale <= 1.005 for one in draws)
    assert all(abs(one.world.ball_start_m) <= shipped.ball_start_m for one in draws)
    assert all(0.9 <= one.world.mass_scale <= 1.1 for one in draws)
    ranges = (
        (shipped.restitution, [one.world.restitution for one in draws]),
        (shipped.drag_scale, [one.world.drag_scale for one in draws]),
        (shipped.lag_s, [one.arm.lag_s for one in draws]),
        (shipped.cup_error_hz, [one.arm.cup_error_hz for one in draws]),
    )
    for (low, high), drawn in ranges:
        values = np.array(drawn, dtype=np.float64)
        assert low <= values.min() < low + 0.05 * (high - low)
        assert high - 0.05 * (high - low) < values.max() <= high
    assert {one.world.joint_friction_fraction for one in draws} == {0.02}
    # uniform: the mean of 500 is within four standard errors of its middle, on the scale that it is drawn on
    assert np.mean([one.world.rope_scale for one in draws]) == pytest.approx(1.0, abs=4 * 0.005 / np.sqrt(3 * 500))
    low, high = np.log(shipped.drag_scale)
    logs = np.log([one.world.drag_scale for one in draws])
    assert np.mean(logs) == pytest.approx((low + high) / 2, abs=4 * (high - low) / np.sqrt(12 * 500))


def test_nothing_is_perturbed_where_nothing_may_differ() -> None:
    values = plain("adapt/uncertainty", "none") | {"restitution": [0.2, 0.2]}
    one = drawn_errors(build(UncertaintySettings, values, "uncertainty"), 0.4, np.random.default_rng(1))
    assert one.world == WorldErrors(restitution=0.2)
    assert (one.arm.lag_s, one.arm.cup_error_m) == (0.0, 0.0)


@pytest.mark.parametrize("name", ["drag_scale", "restitution", "lag_s", "cup_error_hz"])
def test_a_range_the_wrong_way_round_is_refused(name: str) -> None:
    with pytest.raises(ConfigError, match=rf"'{name}' is \[0\.4, 0\.1\]; allowed: least, then largest"):
        dataclasses.replace(_preset("hard"), **{name: (0.4, 0.1)})


@pytest.mark.parametrize(("k", "n"), [(0, 30), (28, 30), (30, 30), (194, 200)])
def test_the_interval_leaves_a_fortieth_on_either_side(k: int, n: int) -> None:
    interval = success_interval(k, n)
    assert interval.low <= k / n <= interval.high
    if k > 0:
        assert binom.sf(k - 1, n, interval.low) == pytest.approx(0.025)
    if k < n:
        assert binom.cdf(k, n, interval.high) == pytest.approx(0.025)


def test_the_exact_interval_has_its_published_value() -> None:
    """Clopper and Pearson 1934; 81 of 263 as in R. G. Newcombe, Statist. Med. 17, 1998, table I, method 5."""
    interval = success_interval(81, 263)
    assert (interval.low, interval.high) == pytest.approx((0.2527, 0.3676), abs=5e-5)


def test_without_repeats_nothing_is_known() -> None:
    assert (success_interval(0, 0).low, success_interval(0, 0).high) == (0.0, 1.0)
