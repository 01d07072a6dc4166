"""Exact interval of a proportion."""

from __future__ import annotations

import pytest
from scipy.stats import binom

from kendama_cli.artifacts.proportion import success_interval


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
