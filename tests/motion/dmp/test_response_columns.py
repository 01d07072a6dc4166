"""Responses to single functions: the same motions as Runge-Kutta's, at any instant, for all widths at once."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from kendama_cli.motion.dmp.basis import Basis
from kendama_cli.motion.dmp.primitive import solve
from kendama_cli.motion.dmp.response_columns import read_rows, response_columns
from kendama_cli.schema.arrays import Array

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


def exact(basis: Basis, share: Array) -> Array:
    """Return value and five derivatives of the columns at ``share`` (n,); (6, n, 4 + m): eq. 3 by other means.

    Its solution by scipy, its free motions by their formula, and derivatives of the features through Chebyshev's
    polynomials; y'' = r - 2 w y' - w^2 y is differentiated.
    """
    w, m = basis.frequency, basis.functions
    drive = np.polynomial.chebyshev.Chebyshev.interpolate
    forces = [drive(lambda s, j=j: basis.features(s)[:, j], 160, [-0.05, 1.05]) for j in range(m)]

    def slope(s: float, state: Array) -> Array:
        y, rate = state.reshape(2, m)
        return np.concatenate((rate, basis.features(np.array([s]))[0] - 2 * w * rate - w**2 * y))

    made = solve_ivp(slope, (0, 1), np.zeros(2 * m), t_eval=share, rtol=1e-11, atol=1e-13, method="DOP853").y
    rows = list(made.reshape(2, m, -1).transpose(0, 2, 1))
    for order in range(4):
        push = np.column_stack([force.deriv(order)(share) if order else force(share) for force in forces])
        rows.append(push - 2 * w * rows[-1] - w**2 * rows[-2])
    free = []
    for start, rate in ((1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (1.0, -1.0)):  # of y0, y0', g and g'
        path, fade = start + (rate + w * start) * share, np.exp(-w * share)
        free.append([(-w) ** k * path * fade + k * (-w) ** (k - 1) * (rate + w * start) * fade for k in range(6)])
    columns = np.array(free).transpose(1, 2, 0)
    columns[0, :, 2] += 1.0
    columns[0, :, 3] += share - 1.0
    columns[1, :, 3] += 1.0
    return np.concatenate((columns, np.array(rows)), axis=2)


@pytest.mark.parametrize(("functions", "stiffness", "decay"), [(9, 225.0, 1.0), (14, 1000.0, 1.6)])
def test_ends_miss_and_jerk_are_those_of_the_equation(functions: int, stiffness: float, decay: float) -> None:
    """Each node's rows, five derivatives at both ends, the miss of the goal, and the jerk, weighted by trapezoids."""
    bases = [Basis(functions, stiffness, decay, width) for width in WIDTHS[1:]]
    made = response_columns(bases)
    nodes = made.jerk.shape[1]
    for k, basis in enumerate(bases):
        wanted = exact(basis, np.linspace(0.0, 1.0, nodes))
        for order in range(6):
            size = np.abs(wanted[order]).max(axis=0)
            ours, theirs = made.ends[order, k] / size, wanted[order, [0, -1]] / size
            assert ours == pytest.approx(theirs, abs=1e-6 if order < 4 else 1e-4)
        rows = wanted[:3] * (1.0 / (nodes - 1)) ** np.arange(3)[:, None, None]
        ours = made.rows[k].reshape(nodes, 3, -1).transpose(1, 0, 2)
        assert ours == pytest.approx(rows, abs=1e-8 * np.abs(rows[0]).max())
        goal = np.eye(4 + functions)[[2, 3]]
        missed = (wanted[:2, -1] - goal) / [[1.0], [basis.frequency]]
        assert made.miss[k] == pytest.approx(missed, abs=1e-7 * np.abs(wanted[0]).max())
        weights = np.sqrt(np.where(np.arange(nodes) % (nodes - 1), 1.0, 0.5) / (nodes - 1))[:, None]
        assert made.jerk[k] == pytest.approx(wanted[3] * weights, abs=1e-6 * np.abs(wanted[3]).max())
