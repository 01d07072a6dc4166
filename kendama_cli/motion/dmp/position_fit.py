"""Least squares on the positions: the motion is linear in its start, goal, end velocities and weights.

    y(s) = g + g' (s - 1) + e(s),   e = (y0 - g + g') a(s) + (y0' - g') b(s) + sum_j w_j B_j(s)

a, b and B_j are the responses of eq. 3 to a unit distance, a unit rate and one basis function (``response_columns``),
so no derivative of the samples is needed. The motion is to reach its goal: e(1) = e'(1) = 0. Among such motions

    min  sum_i |y(s_i) - p_i|^2 + lambda n int |y'''|^2 ds

and lambda, the price of jerk, by generalised cross-validation (G. Wahba, "Spline models for observational data", 1990):
the least n RSS / (n - dof)^2, with RSS and degrees of freedom from a factorisation that is kept for the next
demonstration of as many samples.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache, partial

import numpy as np

from kendama_cli.motion.dmp.basis import Basis
from kendama_cli.motion.dmp.even_samples import CommonFunctions, common_functions, node_sums
from kendama_cli.motion.dmp.response_columns import ResponseColumns, read_rows, response_columns
from kendama_cli.schema.arrays import Array

PRICES = 10.0 ** np.arange(-16.0, -5.5, 0.5)
"""lambda: from a price that only holds what no sample holds to one that leaves a single bend."""

LEAST_FREEDOM = 0.2
"""Fraction of the samples that must remain without the degrees of freedom: fewer cannot tell noise from motion."""

ONE_THREAD = 250_000
"""Products of fewer multiplications stay on one thread in BLAS, which here is faster and never waits for a core."""

QR_ROWS = 256
"""Rows that LAPACK factorises on one thread."""

END_WEIGHT = 10.0
"""The motion's miss of its goal counts as so many times the samples' own: enough that it is met to a micrometre."""

LEAST_COLUMN = 1e-6
"""Directions in which the motion does not change, relative to the others, are held at zero by this much."""

LEAST_SEEN = 1e-3
"""Of what dense samples see of a function: where they see less, normal equations would lose digits."""

DENSE = 6
"""So many even samples a node, and the series of what the functions make with each other is right to 2e-11."""

NONE = 1e-6
"""Freedom of a price that is out of the question."""

RESOLUTION_M = 1e-7
"""No recording is finer; residuals below it are rounding."""


@dataclass(frozen=True)
class Ends:
    """Freedom of a motion to have a velocity at its start and at its end."""

    start_moves: bool
    end_moves: bool

    @property
    def columns(self) -> list[int]:
        """Return the numbers of the free columns among y0, y0', g, g'."""
        return [0, *([1] if self.start_moves else []), 2, *([3] if self.end_moves else [])]


@dataclass(frozen=True)
class Operator:
    """The factorised least squares for one set of n shares and W bases, with p free parameters.

    Parameters = ``lift`` (shrink * (``turn`` seen)) with seen what the functions have in common with the positions;
    lambda is one of L ``PRICES``.
    """

    see: Callable[[Array], Array]
    """From rows of samples (r, n) to their products with the functions (W, r, p)"""
    turn: Array
    """(W, p, p): from those to components, which are orthonormal"""
    lift: Array
    """(W, 4 + m, p): y0, y0', g, g' and the weights"""
    shrink: Array
    """(W, L, p): 1 / (1 + lambda n jerk)"""
    kept: Array
    """(W, L, p): 2 shrink - shrink^2, the fraction of a component's square that leaves the residual"""
    freedom: Array
    """(W, L): n - dof"""


@dataclass(frozen=True)
class Projection:
    """Projection of N swings by an operator: ``components`` (W, N, k, p), cross-validated variances ``score`` (W,
    L, N).
    """

    components: Array
    score: Array


def project(operator: Operator, position: Array) -> Projection:
    """Project the swings ``position`` (N, k, n) at the operator's fractions, with the score of every lambda [m^2]."""
    count, axes, n = position.shape
    z = operator.see(position.reshape(-1, n)) @ operator.turn.transpose(0, 2, 1)
    z = z.reshape(len(z), count, axes, -1)
    total = (position**2).reshape(count, -1).sum(axis=1)
    rss = total - operator.kept @ (z**2).sum(axis=2).transpose(0, 2, 1)
    return Projection(z, n * np.maximum(rss, n * axes * RESOLUTION_M**2) / operator.freedom[:, :, None] ** 2)


def _products(seen: Array, rows: Array) -> Array:
    """Return ``rows`` (r, n) times ``seen`` (W, n, p), so many rows at once that BLAS stays on one thread; (W, r,
    p).
    """
    at_once = max(1, ONE_THREAD // seen[0].size)
    parts = [rows[i : i + at_once] @ seen for i in range(0, len(rows), at_once)]
    return np.concatenate(parts, axis=1)


def solve_positions(operator: Operator, position: Array) -> Array:
    """Return y0, y0', g, g' and weights (N, k, 4 + m) of swings (N, k, n), each with its best lambda, on the first
    basis.
    """
    found = project(operator, position)
    best = operator.shrink[0][found.score[0].argmin(axis=0)]
    return np.asarray((best[:, None] * found.components[0]) @ operator.lift[0].T)


@lru_cache(maxsize=128)
def even_operator(count: int, bases: tuple[Basis, ...], ends: Ends) -> Operator:
    """Return the operator for ``count`` even samples."""
    common = _common(bases, ends)
    if count < DENSE * common.nodes:
        return operator(np.linspace(0.0, 1.0, count), bases, ends)
    see = partial(_node_products, common)
    found = _by_normal_equations(common, count, common.gram.at(count), see, _free(bases[0], ends))
    return found or operator(np.linspace(0.0, 1.0, count), bases, ends)


def _node_products(common: CommonFunctions, rows: Array) -> Array:
    return node_sums(rows, common.nodes) @ common.rows


def operator(share: Array, bases: tuple[Basis, ...], ends: Ends) -> Operator:
    """Factorise the least squares for ``share`` (n,), for each of ``bases``."""
    n, common = len(share), _common(bases, ends)
    found = None
    if n >= 2 * common.lift.shape[1]:
        seen = common.at(share)
        gram = seen.transpose(0, 2, 1) @ seen
        found = _by_normal_equations(common, n, gram, partial(_products, seen), _free(bases[0], ends))
    if found is None:
        seen, rotation, lift, shrink = (
            np.array(one) for one in zip(*(_by_columns(share, basis, ends) for basis in bases), strict=True)
        )
        found = _operator(n, partial(_products, seen), rotation, lift, shrink)
    return found


def _operator(n: int, see: Callable[[Array], Array], turn: Array, lift: Array, shrink: Array) -> Operator:
    freedom = n - shrink.sum(axis=2)
    # a score from hardly any freedom would praise a motion that runs through every sample; the smoothest always counts
    freedom = np.where(freedom < LEAST_FREEDOM * n, NONE, freedom)
    freedom[:, -1] = np.maximum(freedom[:, -1], 0.5)
    return Operator(see, turn, lift, shrink, 2 * shrink - shrink**2, freedom)


def _by_normal_equations(
    common: CommonFunctions, n: int, products: Array, see: Callable[[Array], Array], free: list[int]
) -> Operator | None:
    """Return the operator by the functions' ``products`` (W, p, p) over n samples; None if the samples do not
    determine all.
    """
    gram = products + n * common.miss
    # LEAST_COLUMN of each column's own size, as in ``_by_columns``
    size2 = (common.triangle * (gram @ common.triangle)).sum(axis=1)
    gram += LEAST_COLUMN**2 * (common.lift.transpose(0, 2, 1) * size2[:, None]) @ common.lift
    triangle = np.linalg.cholesky(gram)
    if (np.diagonal(triangle, axis1=1, axis2=2) ** 2).min() < LEAST_SEEN * n:
        return None
    inverse = np.linalg.inv(triangle)
    squared, rotation = np.linalg.eigh(inverse @ common.jerk @ inverse.transpose(0, 2, 1))
    to_components = rotation.transpose(0, 2, 1) @ inverse
    lift = np.zeros((len(gram), max(free) + 1, len(free)))
    lift[:, free] = common.lift @ to_components.transpose(0, 2, 1)
    shrink = 1.0 / (1.0 + PRICES[:, None] * n * np.maximum(squared, 0.0)[:, None])
    return _operator(n, see, to_components, lift, shrink)


def _free(basis: Basis, ends: Ends) -> list[int]:
    return ends.columns + list(range(4, 4 + basis.functions))


@lru_cache(maxsize=64)
def _common(bases: tuple[Basis, ...], ends: Ends) -> CommonFunctions:
    return common_functions(_columns(bases), _free(bases[0], ends), END_WEIGHT)


@lru_cache(maxsize=16)
def _columns(bases: tuple[Basis, ...]) -> ResponseColumns:
    return response_columns(bases)


def _by_columns(share: Array, basis: Basis, ends: Ends) -> tuple[Array, Array, Array, Array]:
    """Return Q and R of the columns themselves: safe if samples are few or far between."""
    n, free = len(share), _free(basis, ends)
    columns = _columns((basis,))
    position, miss = read_rows(columns.rows, share)[0][:, free], columns.miss[0][:, free]
    jerk = _tall_qr(columns.jerk[0][:, free])[1]
    rows = np.vstack((position, END_WEIGHT * np.sqrt(n) * miss))
    size = np.linalg.norm(rows, axis=0)
    orthonormal, triangle = _tall_qr(np.vstack((rows / size, LEAST_COLUMN * np.eye(len(free)))))
    inverse = np.linalg.inv(triangle)
    _, bend, rotation = np.linalg.svd((jerk / size) @ inverse, full_matrices=False)
    lift = np.zeros((4 + basis.functions, len(free)))
    lift[free] = (inverse @ rotation.T) / size[:, None]
    return orthonormal[:n], rotation, lift, 1.0 / (1.0 + PRICES[:, None] * n * bend**2)


def _tall_qr(rows: Array) -> tuple[Array, Array]:
    """Return Q and R of a tall matrix, block by block: blocks are small enough for LAPACK to stay on one thread.

    On a busy machine threads that wait for a core make a factorisation a hundred times slower.
    """
    count, columns = rows.shape
    blocks = np.zeros((-(-count // QR_ROWS) * QR_ROWS, columns))
    blocks[:count] = rows
    within, triangles = np.linalg.qr(blocks.reshape(-1, QR_ROWS, columns))
    across, triangle = np.linalg.qr(triangles.reshape(-1, columns))
    return (within @ across.reshape(-1, columns, columns)).reshape(-1, columns)[:count], triangle
