from __future__ import annotations

import dataclasses
from collections.abc import Callable

import numpy as np
import pytest
import yaml
from scipy.stats import binom

from kendama_cli.artifacts.proportion import success_interval
from kendama_cli.schema.settings import build
from kendama_cli.simulation.catch.settings import PerturbationSettings
from kendama_cli.simulation.catch.uncertainty import (
    CORNERS,
    LEAST_SPREAD_M,
    Repeat,
    corner_errors,
    drawn_errors,
    predicted_success,
)
from tests.simulation.dart.bench_robot import ROOT

MOUTH_M = 0.038
SHIPPED = build(
    PerturbationSettings, yaml.safe_load((ROOT / "conf/adapt/catch.yaml").read_text())["perturbation"], "perturbation"
)


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


def test_the_corners_are_the_extremes_and_every_draw_is_within() -> None:
    corners = [corner_errors(SHIPPED, 0.4, index) for index in range(len(CORNERS))]
    assert {one.rope_scale for one in corners} == {0.995, 1.005}
    assert {one.restitution for one in corners} == set(SHIPPED.restitution)
    assert len({(one.rope_scale, one.ball_start_m) for one in corners}) == 4
    rng = np.random.default_rng(0)
    draws = [drawn_errors(SHIPPED, 0.4, rng) for _ in range(500)]
    assert all(0.995 <= one.rope_scale <= 1.005 for one in draws)
    assert all(abs(one.ball_start_m) <= SHIPPED.ball_start_m for one in draws)
    assert all(0.1 <= float(one.restitution or 0) <= 0.4 for one in draws)
    assert {one.joint_friction_share for one in draws} == {0.02}
    # uniform: the mean of 500 is within four standard errors of its middle
    assert np.mean([one.rope_scale for one in draws]) == pytest.approx(1.0, abs=4 * 0.005 / np.sqrt(3 * 500))


def test_nothing_is_perturbed_where_nothing_may_differ() -> None:
    none = dataclasses.replace(SHIPPED, rope_m=0.0, ball_start_m=0.0, joint_friction_share=0.0, restitution=(0.2, 0.2))
    one = drawn_errors(none, 0.4, np.random.default_rng(1))
    assert (one.rope_scale, one.ball_start_m, one.joint_friction_nm, one.joint_friction_share) == (1.0, 0.0, 0.0, 0.0)
    assert one.restitution == pytest.approx(0.2)


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
