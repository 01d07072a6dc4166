"""Responses to single functions: the same motions as Runge-Kutta's, at any instant, for all widths at once."""

from __future__ import annotations

import numpy as np
import pytest

from kendama_cli.motion.dmp.basis import Basis
from kendama_cli.motion.dmp.primitive import solve
from kendama_cli.motion.dmp.response_columns import read_rows, response_columns

WIDTHS = (0.5, 0.7, 1.35)


@pytest.mark.parametrize(("functions", "stiffness"), [(20, 1000.0), (20, 1e4), (20, 100.0), (5, 1000.0), (60, 1000.0)])
def test_they_are_what_runge_kutta_gives_with_eight_times_its_steps(functions, stiffness):
    """2e-8 is the largest of these 15: nanometres of a swing."""
    bases = [Basis(functions, stiffness, 1.0, width) for width in WIDTHS]
    fraction = np.random.default_rng(10000).uniform(0.0, 1.0, 300)
    made = read_rows(response_columns(bases).rows, fraction)[:, :, 4:]
    still = np.zeros(functions)
    for basis, ours in zip(bases, made, strict=True):
        theirs = solve(basis.features, still, still, basis.frequency, 8000).at(fraction).position
        assert np.abs(ours - theirs).max() < 2e-8 * np.abs(theirs).max()


def test_the_first_four_columns_carry_the_ends_and_the_miss_is_what_is_left_there():
    made = response_columns([Basis(20, 1000.0, 1.0, 0.9)])
    start, end = read_rows(made.rows, np.array([0.0, 1.0]))[0]
    np.testing.assert_allclose(start[:4], [1.0, 0.0, 0.0, 0.0], atol=1e-12)
    np.testing.assert_allclose(end - np.eye(24)[2], made.miss[0, 0], atol=1e-12)


def test_the_jerk_is_the_third_derivative():
    """Against differences of the value; the swing begins and ends in kinks of its own, which are left out."""
    columns = response_columns([Basis(20, 1000.0, 1.0, 1.0)])
    nodes = columns.jerk.shape[1] - 1
    fraction, step = np.arange(20, nodes - 20) / nodes, 1e-3
    positions = (read_rows(columns.rows, fraction + k * step)[0] for k in (-2, -1, 1, 2))
    far_behind, past, ahead, far_ahead = positions
    third = (far_ahead - 2 * ahead + 2 * past - far_behind) / (2 * step**3)
    ours = columns.jerk[0, 20 : nodes - 20] * np.sqrt(nodes)
    assert np.abs(ours - third).max() < 0.01 * np.abs(third).max()


def test_the_ends_of_the_jerk_count_by_half():
    """Its squares sum to an integral by trapezoids; beyond the ends the value goes on as its last quintic does."""
    columns = response_columns([Basis(20, 1000.0, 1.0, 1.0)])
    nodes, step = columns.jerk.shape[1] - 1, 1e-4
    for end, inward in ((0, 1), (nodes, -1)):
        values = read_rows(columns.rows, end / nodes + inward * step * np.arange(4))[0]
        third = inward * (values[3] - 3 * values[2] + 3 * values[1] - values[0]) / step**3
        ours = columns.jerk[0, end] * np.sqrt(2 * nodes)
        assert np.abs(ours - third).max() < 0.1 * np.abs(third).max()
