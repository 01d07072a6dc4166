"""Regression of the parameters of primitives over one basis, from the samples of motions.

``lwr``, the paper's, takes each function by itself, repeated on the residual: w_j = sum_i psi_j x f / sum_i psi_j x^2.
It reads f = e'' + D e' + K e of the distance to the goal e = y - g (eq. 3 solved for f), so it needs derivatives of the
samples; ``position_fit`` needs none.
"""

from __future__ import annotations

from collections.abc import Hashable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from itertools import product

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from kendama_cli.motion.dmp.basis import Basis, activations, phase
from kendama_cli.motion.dmp.onset import MIN_SAMPLES, TrimmedDemonstration
from kendama_cli.motion.dmp.position_fit import Ends, Operator, even_operator, operator, project, solve_positions
from kendama_cli.motion.dmp.primitive import goal_path
from kendama_cli.motion.dmp.settings import EncodeSettings
from kendama_cli.schema.arrays import Array


@dataclass(frozen=True)
class Derivatives:
    """Smoothed positions, and derivatives by s, at even shares (n,); arrays are (n, k) [m]."""

    share: Array
    position: Array
    rate: Array
    second: Array


def derivatives(demonstration: TrimmedDemonstration, smoothing_s: float) -> Derivatives:
    """Return the position and its derivatives by s, by local cubics (Savitzky-Golay) over ``smoothing_s`` of even
    samples.
    """
    n = len(demonstration.position_m)
    grid = np.linspace(0.0, 1.0, n)
    even = (
        demonstration.position_m
        if demonstration.even
        else np.asarray(CubicSpline(demonstration.share, demonstration.position_m, axis=0)(grid))
    )
    desired = max(MIN_SAMPLES, 2 * round(smoothing_s / demonstration.duration_s * (n - 1) / 2) + 1)
    window = min(desired, n if n % 2 else n - 1)
    return Derivatives(grid, *(_local_cubic(even, window, order, 1.0 / (n - 1)) for order in range(3)))


def _local_cubic(position: Array, window: int, order: int, step: float) -> Array:
    """Return the ``order``-th derivative of even samples (n, k); at the ends, that of the first and last window's
    cubic.

    By fast convolution, so that the effort grows with the samples and hardly with the window.
    """
    from scipy.signal import fftconvolve, savgol_coeffs  # noqa: PLC0415 - half a second to import

    kernel = savgol_coeffs(window, 3, deriv=order, delta=step)[:, None]
    made = fftconvolve(position, kernel, mode="same", axes=0)
    half = window // 2
    at = (np.arange(window) - half) * step
    for samples, ends in ((slice(0, window), slice(0, half)), (slice(-window, None), slice(-half, None))):
        cubic = np.polynomial.polynomial.polyfit(at, position[samples], 3)
        slope = np.polynomial.polynomial.polyder(cubic, order)
        made[samples][ends] = np.polynomial.polynomial.polyval(at[ends], slope).T
    return np.asarray(made)


def target_force(motion: Derivatives, goal: Array, goal_rate: Array, basis: Basis) -> Array:
    """Return f in the motion's own time; (n, c) for ``goal`` and ``goal_rate`` (c,)."""
    path = goal_path(motion.share, goal, goal_rate)
    w = basis.frequency
    force: Array = motion.second + 2 * w * (motion.rate - path.rate) + w**2 * (motion.position - path.position)
    return force


def locally_weighted(share: Array, force: Array, basis: Basis, *, passes: int) -> Array:
    """Return the weights (m, c) by locally weighted regression, ``passes`` times on the residual of f (n, c); 1 is
    the paper's.
    """
    x = phase(share, basis.decay)
    psi = activations(x, basis.centers, basis.widths)
    phi = basis.features(share)
    energy = psi.T @ x**2
    weights = np.zeros((basis.functions, force.shape[1]))
    for _ in range(passes):
        rest = force - phi @ weights
        weights = weights + (psi.T @ (x[:, None] * rest)) / energy[:, None]
    return weights


THINNED = 120
"""Samples at which widths and ends are compared: plenty for 20 functions."""

SURE = 9.0
"""An end moves where that betters n log score by so much: a thousand to one against chance."""


@dataclass(frozen=True)
class Parameters:
    """Parameters that distinguish N primitives of c coordinates over one basis of m functions, in their own time s
    = t / T.

    ``origin_m`` (N, c) is where each starts relative to its first sample; positions are relative to that start.
    """

    duration_s: Array
    """(N,)"""
    origin_m: Array
    """(N, c)"""
    start_rate: Array
    """(N, c)"""
    goal_m: Array
    """(N, c)"""
    goal_rate: Array
    """(N, c)"""
    weights: Array
    """(N, c, m)"""

    def vectors(self) -> Array:
        """Return the columns of ``MotionPlan.variation``: log T, start rate, goal, goal rate, weights; (N, 1 + c (3
        + m)).
        """
        n = len(self.duration_s)
        log_t = np.log(self.duration_s)[:, None]
        return np.hstack((log_t, self.start_rate, self.goal_m, self.goal_rate, self.weights.reshape(n, -1)))


def fit_demonstrations(trimmed: Sequence[TrimmedDemonstration], settings: EncodeSettings) -> tuple[Parameters, Basis]:
    """Fit the parameters of all trimmed demonstrations, and the basis that is best for all of them together."""
    bases = tuple(
        Basis(settings.functions, settings.stiffness, settings.phase_decay, width) for width in settings.width
    )
    if settings.regression == "position":
        ends, basis = _ends_and_basis(trimmed, bases)
        rows = _fit_positions(trimmed, ends, basis)
    else:
        fits = [[_fit_force(demonstration, basis, settings) for demonstration in trimmed] for basis in bases]
        best = int(np.argmin([sum(one.misfit for one in row) for row in fits]))
        basis, rows = bases[best], np.array([one.parameters for one in fits[best]])
    duration = np.array([demonstration.duration_s for demonstration in trimmed])
    goal = rows[:, 2] - rows[:, 0]
    return Parameters(duration, rows[:, 0], rows[:, 1], goal, rows[:, 3], rows[:, 4:].transpose(0, 2, 1)), basis


def _ends_and_basis(trimmed: Sequence[TrimmedDemonstration], bases: tuple[Basis, ...]) -> tuple[list[Ends], Basis]:
    """Return the kind of each demonstration's ends (moving or not), and the basis with the least product of scores."""
    found: dict[int, Ends] = {}
    totals = np.zeros(len(bases))
    thinned = [_thinned(one) for one in trimmed]
    pairs = zip(thinned, trimmed, strict=True)
    for members in _alike(trimmed, [(len(thin), one.starts_still, one.ends_still) for thin, one in pairs]):
        first = trimmed[members[0]]
        starts = (False,) if first.starts_still else (False, True)
        stops = (False,) if first.ends_still else (False, True)
        candidates = [Ends(*pair) for pair in product(starts, stops)]
        thin = np.array([thinned[i].T for i in members])
        seen = [_operator(first, thin.shape[2], _stride(first), bases, ends) for ends in candidates]
        table = np.array([project(one, thin).score.min(axis=1) for one in seen])
        # more freedom must pay, or chance would give resting hands a velocity
        price = np.array([SURE * (len(ends.columns) - 2) / thin.shape[2] for ends in candidates])
        best = np.argmin(np.log(table.min(axis=1)) + price[:, None], axis=0)
        found |= {i: candidates[b] for i, b in zip(members, best, strict=True)}
        # logarithms: metres and radians count alike, and so do swings of any size
        totals += np.log(table[best, :, np.arange(len(members))]).sum(axis=0)
    return [found[i] for i in range(len(trimmed))], bases[int(totals.argmin())]


def _stride(demonstration: TrimmedDemonstration) -> int:
    return -(-len(demonstration.position_m) // THINNED)


def _thinned(demonstration: TrimmedDemonstration) -> Array:
    """Return even samples at ``THINNED`` even fractions, the same for every length; thin others, and fewer, as they
    are.
    """
    position = demonstration.position_m
    if not demonstration.even or len(position) <= THINNED:
        return position[:: _stride(demonstration)]
    first, weights = _cubic_weights(len(position))
    return np.asarray((weights[:, :, None] * position[first]).sum(axis=1))


@lru_cache(maxsize=128)
def _cubic_weights(count: int) -> tuple[NDArray[np.int64], Array]:
    """Return the four of ``count`` even samples about each of ``THINNED`` even fractions, and Lagrange's weights;
    (n, 4) each.
    """
    at = np.linspace(0.0, count - 1.0, THINNED)
    start = np.clip(at.astype(np.int64) - 1, 0, count - 4)
    u = at - start
    v, w, x = u - 1, u - 2, u - 3
    return start[:, None] + np.arange(4), np.column_stack(
        (-v * w * x / 6, u * w * x / 2, -u * v * x / 2, u * v * w / 6)
    )


def _fit_positions(trimmed: Sequence[TrimmedDemonstration], ends: Sequence[Ends], basis: Basis) -> Array:
    """Return y0, y0', g, g' and weights of every demonstration; (N, 4 + m, c)."""
    made: dict[int, Array] = {}
    for members in _alike(trimmed, [(len(one.position_m), mark) for one, mark in zip(trimmed, ends, strict=True)]):
        position = np.array([trimmed[i].position_m.T for i in members])
        first = members[0]
        solved = solve_positions(_operator(trimmed[first], position.shape[2], 1, (basis,), ends[first]), position)
        made |= dict(zip(members, solved, strict=True))
    return np.array([made[i].T for i in range(len(trimmed))])


def _alike(trimmed: Sequence[TrimmedDemonstration], marks: Sequence[Hashable]) -> list[list[int]]:
    """Group the numbers of demonstrations with equal marks: even ones are solved together, each other alone."""
    groups: dict[Hashable, list[int]] = {}
    for i, (demonstration, mark) in enumerate(zip(trimmed, marks, strict=True)):
        groups.setdefault((None if demonstration.even else i, mark), []).append(i)
    return list(groups.values())


def _operator(
    demonstration: TrimmedDemonstration, count: int, stride: int, bases: tuple[Basis, ...], ends: Ends
) -> Operator:
    """Return the operator for ``count`` samples: for even ones, or else for every ``stride``-th."""
    if demonstration.even:
        return even_operator(count, bases, ends)
    return operator(demonstration.share[::stride], bases, ends)


@dataclass(frozen=True)
class _ForceFit:
    parameters: Array
    misfit: float


def _fit_force(demonstration: TrimmedDemonstration, basis: Basis, settings: EncodeSettings) -> _ForceFit:
    """Return y0, y0', g, g' from the local cubics at the ends, weights from f; (4 + m, c)."""
    motion = derivatives(demonstration, settings.smoothing_s)
    nothing = np.zeros(motion.position.shape[1])
    start_rate = motion.rate[0] if demonstration.starts_fast else nothing
    goal_rate = motion.rate[-1] if demonstration.ends_fast else nothing
    force = target_force(motion, motion.position[-1], goal_rate, basis)
    weights = locally_weighted(motion.share, force, basis, passes=settings.passes)
    misfit = float(np.sum((force - basis.features(motion.share) @ weights) ** 2))
    return _ForceFit(np.vstack((motion.position[0], start_rate, motion.position[-1], goal_rate, weights)), misfit)
