"""Sums over even samples of functions that are known at nodes: exact for polynomials, one by one."""

from __future__ import annotations

import numpy as np
import pytest

from kendama_cli.motion.dmp.basis import Basis
from kendama_cli.motion.dmp.even_samples import common_functions, gram_series, node_sums
from kendama_cli.motion.dmp.response_columns import read_rows, response_columns
from kendama_cli.schema.arrays import Array

CELLS = 4


def polynomials(*degrees: int) -> tuple[list[list[np.polynomial.Polynomial]], Array, Array]:
    """Two sets of three random polynomials of s, their rows at CELLS + 1 nodes, and their ends."""
    rng = np.random.default_rng(10026)
    made = [[np.polynomial.Polynomial(rng.normal(size=degree + 1)) for degree in degrees] for _ in range(2)]
    nodes, h = np.arange(CELLS + 1) / CELLS, 1.0 / CELLS

    def of(at: Array, order: int) -> Array:
        return np.array([[one.deriv(order)(at) if order else one(at) for one in row] for row in made])

    rows = np.stack([of(nodes, order) * h**order for order in range(3)], axis=-1)
    ends = np.array([of(np.array([0.0, 1.0]), order).transpose(0, 2, 1) for order in range(6)])
    return made, rows.transpose(0, 2, 3, 1).reshape(2, -1, 3), ends


@pytest.mark.parametrize("degrees", [(3, 3, 3), (5, 1, 1), (4, 2, 2)])
@pytest.mark.parametrize("count", [2, 3, 7, 40])
def test_sums_of_products_are_those_of_euler_and_maclaurin(degrees: tuple[int, int, int], count: int) -> None:
    """The series is exact as far as h^5 where the product is of degree six."""
    made, rows, ends = polynomials(*degrees)
    exact = np.add.outer(degrees, degrees) <= 6
    share = np.linspace(0.0, 1.0, count)
    for row, found in zip(made, gram_series(rows, ends).at(count), strict=True):
        values = np.array([one(share) for one in row])
        assert found[exact] == pytest.approx((values @ values.T)[exact], rel=1e-9, abs=1e-9)


@pytest.mark.parametrize("count", [5, 6, 9, 33])
def test_samples_are_projected_on_the_nodes_of_their_cells(count: int) -> None:
    """Quintics are known from their nodes as they are."""
    made, rows, _ = polynomials(5, 5, 4)
    position = np.random.default_rng(10027).normal(size=(4, count))
    sums = node_sums(position, CELLS + 1) @ rows
    for row, found in zip(made, sums, strict=True):
        values = np.array([one(np.linspace(0.0, 1.0, count)) for one in row])
        assert found == pytest.approx(position @ values.T, rel=1e-9, abs=1e-9)


@pytest.mark.parametrize("free", [[0, 2], [0, 1, 2, 3]])
def test_common_functions_are_orthonormal_over_the_motion_and_its_missed_goal(free: list[int]) -> None:
    columns = response_columns([Basis(8, 400.0, 1.0, width) for width in (0.8, 1.2)])
    free = [*free, *range(4, 12)]
    made = common_functions(columns, free, 10.0)
    share = np.random.default_rng(10028).uniform(0, 1, 20)
    nodes = columns.rows.shape[1] // 3
    assert made.nodes == nodes
    for k in range(2):
        lift, miss = made.lift[k], 10.0 * columns.miss[k][:, free] @ made.lift[k]
        assert made.triangle[k] @ lift == pytest.approx(np.eye(len(free)), abs=1e-8)
        assert made.at(share)[k] == pytest.approx(read_rows(columns.rows, share)[k][:, free] @ lift, abs=1e-9)
        every_other = made.rows[k][::6]
        gram = every_other.T @ every_other / len(every_other) + miss.T @ miss
        assert gram == pytest.approx(np.eye(len(free)), abs=1e-6)
        assert made.miss[k] == pytest.approx(miss.T @ miss, abs=1e-9)
        bend = columns.jerk[k][:, free] @ lift
        assert made.jerk[k] == pytest.approx(bend.T @ bend, rel=1e-9, abs=1e-6 * np.abs(made.jerk[k]).max())
        assert made.ends[:, k] == pytest.approx(columns.ends[:, k][..., free] @ lift)
