from __future__ import annotations

import dataclasses
from collections.abc import Callable

import numpy as np
import pytest
from scipy.stats import binom

from kendama_cli.artifacts.proportion import success_interval
from kendama_cli.errors import ConfigError
from kendama_cli.schema.settings import build
from kendama_cli.simulation.catch.settings import UncertaintySettings
from kendama_cli.simulation.catch.uncertainty import (
    CORNERS,
    LEAST_SPREAD_M,
    Repeat,
    corner_errors,
    drawn_errors,
    predicted_success,
)
from kendama_cli.simulation.dart.world_errors import WorldErrors
from tests.shipped_conf import plain

MOUTH_M = 0.038


def _preset(name: str) -> UncertaintySettings:
    return build(UncertaintySettings, plain("adapt/uncertainty", name), "uncertainty")


def _corners(miss: Callable[[float, float], float]) -> list[Repeat]:
    misses = [miss(u, v) for u, v in CORNERS]
    return [Repeat(abs(one) < MOUTH_M, one) for one in misses]


@pytest.mark.parametrize(
    ("m0", "a", "b", "c"), [(0, 0.02, 0.02, 0), (0.01, 0.03, -0.02, 0.002), (-0.02, 0.005, 0.03, 0)]
)
def test_the_prediction_is_the_share_of_drawn_worlds_that_are_caught(m0: float, a: float, b: float, c: float) -> None:
    def miss(u: float, v: float) -> float:
        return m0 + a * u + b * v + c * u * v

    rng = np.random.default_rng(3)
    u, v = rng.uniform(-1, 1, (2, 200_000))
    drawn = np.abs(m0 + a * u + b * v + c * u * v + rng.normal(0, LEAST_SPREAD_M, u.shape)) < MOUTH_M
    # three standard deviations of 200 000 draws are below 0.0034
    assert predicted_success(m0, _corners(miss), MOUTH_M) == pytest.approx(float(drawn.mean()), abs=0.004)


def test_what_is_centred_promises_more_and_what_is_certain_promises_all() -> None:
    promised = []
    for m0 in (0.0, 0.02, 0.035):
        corners = [Repeat(True, m0 + 0.015 * (u + v)) for u, v in CORNERS]
        corners = [dataclasses.replace(one, caught=abs(one.miss_m or 0.0) < MOUTH_M) for one in corners]
        promised.append(predicted_success(m0, corners, MOUTH_M))
    assert promised == sorted(promised, reverse=True)
    assert promised[0] > 0.999
    assert predicted_success(0.2, _corners(lambda u, v: 0.2), MOUTH_M) < 1e-6


def test_balls_that_jumped_out_and_balls_that_never_came_down_lower_the_promise() -> None:
    good = [Repeat(True, 0.0)] * 4
    assert predicted_success(0.0, good, MOUTH_M) == pytest.approx(1.0)
    assert predicted_success(0.0, [*good[:3], Repeat(False, 0.0)], MOUTH_M) == pytest.approx(0.75)
    assert predicted_success(0.0, [*good[:3], Repeat(False, None)], MOUTH_M) <= 0.5


@pytest.mark.parametrize("preset", ["hard", "identified"])
def test_the_corners_are_the_extremes_and_every_draw_is_within(preset: str) -> None:
    shipped = _preset(preset)
    corners = [corner_errors(shipped, 0.4, index) for index in range(len(CORNERS))]
    assert {one.world.rope_scale for one in corners} == {0.995, 1.005}
    assert {one.world.restitution for one in corners} == set(shipped.restitution)
    assert {one.world.drag_scale for one in corners} == set(shipped.drag_scale)
    assert {one.arm.lag_s for one in corners} == set(shipped.lag_s)
    assert len({(one.world.rope_scale, one.world.ball_start_m) for one in corners}) == 4
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
    assert {one.world.joint_friction_share for one in draws} == {0.02}
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
