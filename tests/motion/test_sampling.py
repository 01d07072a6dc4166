"""Samples over time: steps, thinning, and columns between samples."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.interpolate import make_interp_spline

from kendama_cli.motion.sampling import columns_at, step_s, thinning


def test_columns_lie_on_straight_lines_between_samples_and_are_held_beyond_them() -> None:
    rng = np.random.default_rng(0)
    t_s, columns = np.sort(rng.uniform(0.0, 1.0, 20)), rng.normal(size=(20, 3))
    at_s = rng.uniform(t_s[0], t_s[-1], 50)
    assert columns_at(at_s, t_s, columns) == pytest.approx(make_interp_spline(t_s, columns, k=1)(at_s))
    assert columns_at(at_s[0], t_s, columns).shape == (3,)
    assert columns_at(np.array([-9.0, 9.0]), t_s, columns).tolist() == columns[[0, -1]].tolist()


@pytest.mark.parametrize(("every_s", "one_in"), [(0.01, 10), (0.0104, 10), (0.0106, 11), (0.0001, 1)])
def test_thinning_takes_the_nearest_whole_number_of_samples_and_all_where_they_are_few(
    every_s: float, one_in: int
) -> None:
    assert thinning(0.001 * np.arange(2000), every_s) == one_in


def test_a_gap_does_not_change_the_step() -> None:
    assert step_s(np.array([0.0, 0.1, 0.2, 0.3, 5.0])) == pytest.approx(0.1)
