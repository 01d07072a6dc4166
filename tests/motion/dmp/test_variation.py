"""The average as a distribution: what is drawn from it varies as the demonstrations do."""

from __future__ import annotations

import numpy as np
import pytest

from kendama_cli.artifacts.demonstration import Demonstration
from kendama_cli.motion.dmp.averaging import Encoding, encode, prepare
from kendama_cli.motion.dmp.primitive import covariance, parameters, play, sample_plan, with_parameters
from tests.motion.swings import demonstration, path, settings

SHARE = np.linspace(0, 1, 40)


@pytest.fixture(scope="module")
def encoding() -> Encoding:
    rng = np.random.default_rng(12)
    swings = []
    for i in range(8):
        duration = 2.0 * np.exp(0.05 * rng.standard_normal())
        t = np.arange(round(100 * duration) + 1) / 100
        size = 1 + 0.1 * rng.standard_normal(3)
        swings.append(Demonstration(f"d{i}", t, size * path(t, duration)))
    return encode(prepare(swings, settings()), settings())


def test_the_covariance_is_that_of_the_demonstrations_parameters(encoding: Encoding) -> None:
    rows = np.array([parameters(encoding.plan(i)) for i in range(len(encoding))])
    assert np.allclose(covariance(encoding.average()), np.cov(rows.T), rtol=1e-9, atol=1e-9)


def test_parameters_go_in_and_out(encoding: Encoding) -> None:
    one, other = encoding.plan(0), encoding.plan(1)
    made = with_parameters(one, parameters(other))
    assert np.allclose(made.weights, other.weights)
    assert made.duration_s == pytest.approx(other.duration_s)
    assert np.allclose(made.goal_m, other.goal_m)


def test_drawn_swings_have_the_demonstrations_mean_and_spread(encoding: Encoding) -> None:
    mean = encoding.average()
    rng = np.random.default_rng(0)
    plans = [sample_plan(mean, rng) for _ in range(400)]
    drawn = np.array([play(plan, SHARE * plan.duration_s, steps=200).position_m for plan in plans])
    own = [encoding.plan(i) for i in range(len(encoding))]
    demonstrated = np.array([play(plan, SHARE * plan.duration_s, steps=200).position_m for plan in own])
    spread = demonstrated.std(axis=0, ddof=1)
    # 400 draws: the mean within 4 standard errors, the standard deviation within 4 x 3.5 %
    assert np.abs(drawn.mean(axis=0) - demonstrated.mean(axis=0)).max() < 4 * spread.max() / 20
    assert np.abs(drawn.std(axis=0) - spread).max() < 0.16 * spread.max()
    logs = np.log([plan.duration_s for plan in plans])
    assert np.std(logs) == pytest.approx(np.std([np.log(plan.duration_s) for plan in own], ddof=1), rel=0.16)


def test_the_same_seed_draws_the_same_swing_and_scale_zero_the_mean(encoding: Encoding) -> None:
    mean = encoding.average()
    one, other = (sample_plan(mean, np.random.default_rng(5)) for _ in range(2))
    assert np.array_equal(one.weights, other.weights)
    assert np.allclose(sample_plan(mean, np.random.default_rng(5), 0.0).weights, mean.weights)


def test_one_demonstration_has_no_spread() -> None:
    chosen = settings()
    plan = encode(prepare([demonstration()], chosen), chosen).average()
    assert not covariance(plan).any()
    assert np.allclose(sample_plan(plan, np.random.default_rng(1)).weights, plan.weights)
