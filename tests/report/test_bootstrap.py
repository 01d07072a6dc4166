"""Bootstrap intervals: they hold what they promise, and are the same every time."""

from __future__ import annotations

import numpy as np
import pytest

from kendama_cli.report.bootstrap import bootstrap, bootstrap_curve, bootstrap_ratio, interquartile_mean, p90


def test_the_interval_of_the_mean_is_the_normal_one_for_many_values():
    values = np.random.default_rng(1).exponential(10.0, 400)
    interval = bootstrap(values, np.mean)
    half = 1.96 * values.std() / 20.0
    assert interval == pytest.approx((values.mean() - half, values.mean() + half), rel=0.03)


def test_the_interval_covers_the_truth_about_as_often_as_it_says():
    """200 samples of 40: the coverage of a 95 % interval lies in 0.88 .. 1 with more than four deviations to spare."""
    rng = np.random.default_rng(2)
    covered = 0
    for _ in range(200):
        low, high = bootstrap(rng.normal(5.0, 1.0, 40), np.mean) or (0.0, 0.0)
        covered += low <= 5.0 <= high
    assert 0.88 <= covered / 200 < 1.0


def test_the_order_of_the_seeds_changes_nothing():
    values = np.random.default_rng(3).integers(1, 100, 50).astype(float)
    for statistic in (np.mean, np.median, p90):
        assert bootstrap(values, statistic) == bootstrap(values[::-1], statistic)


def test_the_ratio_of_equals_holds_one_and_of_a_tenfold_does_not():
    rng = np.random.default_rng(4)
    values, others = rng.exponential(10.0, 100), rng.exponential(10.0, 100)
    low, high = bootstrap_ratio(values, others, np.mean) or (0.0, 0.0)
    assert low < 1.0 < high
    low, high = bootstrap_ratio(10.0 * values, others, np.mean) or (0.0, 0.0)
    assert 5.0 < low < 10.0 < high


def test_one_value_has_no_interval():
    assert bootstrap(np.ones(1), np.mean) is None
    assert bootstrap_ratio(np.ones(5), np.ones(1), np.mean) is None


def test_the_interquartile_mean_leaves_the_outer_quarters_out_and_counts_what_lies_on_their_edges_in_part():
    assert interquartile_mean([100.0, 1.0, 3.0, -50.0], axis=0) == 2.0
    assert interquartile_mean([0.0, 1.0, 8.0], axis=0) == (0.25 * 0.0 + 1.0 + 0.25 * 8.0) / 1.5
    both = interquartile_mean([[100.0, 1.0, 3.0, -50.0], [4.0, 4.0, 4.0, 9.0]], axis=1)
    assert both.tolist() == [2.0, 4.0]


def test_a_curves_band_is_narrow_where_the_runs_agree():
    rng = np.random.default_rng(10000)
    curves = 3.0 + rng.standard_normal((40, 2)) * (0.1, 1.0)
    low, high = bootstrap_curve(curves, interquartile_mean)
    assert (low < 3.2).all()
    assert (high > 2.8).all()
    assert (high - low)[0] < 0.3 * (high - low)[1]
