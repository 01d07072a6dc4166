"""The plane in which a ball swings, from one camera, and the ball's depth from it and from the ball's size together."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np
from scipy.optimize import least_squares

from kendama_cli.schema.arrays import Array

ROPE_SIGMA_PX = 0.5
"""Standard deviation of a taut rope's length as it is seen; what is farther off is a slack rope."""
SIZE_PART = 0.02
"""A blurred ball looks smaller by about so much: the part by which all radii may be off together."""
MOST_SIZE = 0.08
"""A ball that looks so much larger or smaller than it is swings on another rope, or is another."""
MOST_OFF_PLANE = 0.25
"""A ball that moves out of the plane by more than this part of what it moves in it has no plane, or another rope."""
STEEP = 2.0
"""Tangent of the angle between the plane and the image: what is believed of it before."""
STARTS = ((0.0, 0.0), (0.7, 0.0), (-0.7, 0.0), (0.0, 0.5), (0.0, -0.5))
TAUT_PX = 3.0
LEAST_TAUT, FEWEST = 0.5, 12
"""At least this part of the sightings, and so many, must lie on one circle of the rope."""
OFF_PLANE_LENGTH_S = 0.3
"""How long a motion out of the plane keeps its sense: about a quarter of a swing."""
OFF_PLANE_M = np.geomspace(5e-3, 0.3, 13)
OFF_PLANE_START_M = 0.02
KNOT_S = 0.12
LIKELY, ROUNDS, STEPS = 2, 3, 40
MOST = 600
"""So many sightings, the first, are enough for the plane."""
NEAREST_M = 0.05
PIECE = 400
"""So many sightings are judged together where motion out of the plane is smoothed."""


@dataclass(frozen=True)
class Plane:
    """The points p of the camera's frame with normal . p = distance_m, and the covariance (3, 3) of normal / distance.

    ``size`` is by how much larger than it is the ball looks.
    """

    normal: Array
    distance_m: float
    covariance: Array
    size: float = 1.0

    def depth_m(self, rays: Array) -> Array:
        """Depth (n,) where ``rays`` (n, 3), of length 1 along the optical axis, meet it."""
        return np.asarray(self.distance_m / (rays @ self.normal))

    def sigma_m(self, rays: Array) -> Array:
        """Standard deviation (n,) of that depth Z = 1 / (ray . m), m = normal / distance: dZ = -Z^2 ray . dm."""
        spread = np.einsum("ni,ij,nj->n", rays, self.covariance, rays)
        return np.asarray(self.depth_m(rays) ** 2 * np.sqrt(np.maximum(spread, 0.0)))


@dataclass(frozen=True)
class SizedSights:
    """Rays (n, 3) at times (n,), of length 1 along the optical axis, and the depth (n,) by the ball's size with its
    standard deviation, of which ``focal_px`` pixels make a radian in the middle."""

    t_s: Array
    rays: Array
    focal_px: float
    depth_m: Array
    sigma_m: Array


@dataclass(frozen=True)
class FusedDepth:
    """Depth (n,) and its standard deviation [m]; how far off the plane the ball is (n,) [m], with its own."""

    depth_m: Array
    sigma_m: Array
    off_plane_m: Array
    off_plane_sigma_m: Array


def rope_plane(sights: SizedSights, rope_m: float) -> Plane | None:
    """The plane of a swing about a fixed point, whose rope of ``rope_m`` is taut most of the time.

    The ball is off the plane by b(t), a process of mean 0 (see ``fuse``), at the points p_i of depth
    Z_i = (distance + b(t_i)) / (normal . ray_i); with o the tie in the plane,

        (|p_i - o| - rope) focal / Z_i = 0 within ROPE_SIGMA_PX    and    Z_i = (1 + a) Z_i(size) within its sigma,

    a common to all (SIZE_PART). Least squares with a loss that bears slack frames, from several tilts: seen by one
    camera the swing tilted to and fro looks nearly the same. None where the sightings lie on no such circle.
    """
    if len(sights.rays) < FEWEST:
        return None
    first = (values[:MOST] for values in (sights.t_s, sights.rays, sights.depth_m, sights.sigma_m))
    t_s, rays, depth_m, sigma_m = first
    few = SizedSights(t_s, rays, sights.focal_px, depth_m, sigma_m)
    seen = _Seen(few, rope_m)
    flat = [seen.solved(seen.start(tilt), 0.0, 4 * ROPE_SIGMA_PX) for tilt in STARTS]
    starts = [fit.values for fit in sorted(flat, key=lambda one: one.cost)[:LIKELY]]
    spread_m, sigma_px, best = OFF_PLANE_START_M, ROPE_SIGMA_PX, flat[0]
    for _ in range(ROUNDS):
        best = min((seen.solved(start, spread_m, sigma_px) for start in starts), key=lambda one: one.cost)
        off_px = np.abs(seen.rope_px(best.values))
        taut = off_px < TAUT_PX
        if np.count_nonzero(taut) < max(LEAST_TAUT * len(off_px), FEWEST):
            return None
        sigma_px = max(1.4826 * float(np.median(off_px[taut])), ROPE_SIGMA_PX / 3)
        spread_m = _spread_m(best.plane, few)
        starts = [best.values]
    extent_m = float(np.linalg.norm(np.std(best.plane.depth_m(few.rays)[:, None] * few.rays, axis=0)))
    is_swing = abs(math.log(best.plane.size)) < MOST_SIZE and spread_m < MOST_OFF_PLANE * extent_m
    return best.plane if is_swing else None


@dataclass(frozen=True)
class _Fit:
    cost: float
    values: Array
    plane: Plane


@dataclass(frozen=True)
class _Seen:
    """What ``rope_plane`` explains by values: the tie's direction (2,) and log depth, the plane's tilt (2,), a, and the
    offset b at knots over time, whitened."""

    sights: SizedSights
    rope_m: float

    @cached_property
    def offsets(self) -> Array:
        """b(t_i) / spread (n,) is this matrix (n, k) times k whitened values."""
        first_s, last_s = self.sights.t_s[0], self.sights.t_s[-1]
        knots = np.linspace(first_s, last_s, max(4, math.ceil((last_s - first_s) / KNOT_S)))
        among = _matern(knots, knots) + 1e-6 * np.eye(len(knots))
        factor = np.linalg.cholesky(among)
        return np.asarray(np.linalg.solve(factor, _matern(knots, self.sights.t_s)).T)

    def start(self, tilt: tuple[float, float]) -> Array:
        """Values of a plane with ``tilt`` through the circle of the rope."""
        depth_m = float(np.median(self.sights.depth_m))
        pixels = self.sights.focal_px * self.sights.rays[:, :2]
        middle = _circle_middle(pixels, self.sights.focal_px * self.rope_m / depth_m) / self.sights.focal_px
        return np.array([*middle, math.log(depth_m), *tilt, 0.0, *np.zeros(self.offsets.shape[1])])

    def solved(self, start: Array, spread_m: float, sigma_px: float) -> _Fit:
        """The values near ``start`` that explain best what was seen; without a spread, none but a flat swing's."""
        priors = np.array([STEEP, STEEP, SIZE_PART])
        knots = self.offsets.shape[1]

        def whole(found: Array) -> Array:
            return np.concatenate([found[:6], spread_m * found[6:] if spread_m else np.zeros(knots)])

        def misses(found: Array) -> Array:
            values = whole(found)
            depth = self._depth_m(values)
            if not (depth > NEAREST_M).all():
                return np.full(2 * len(depth) + 3 + len(found) - 6, 1e3)
            size = (math.exp(values[5]) * self.sights.depth_m - depth) / self.sights.sigma_m
            given = np.concatenate([values[3:6] / priors, found[6:]])
            return np.concatenate([_soft(self.rope_px(values) / sigma_px), _soft(size), given])

        begin = np.concatenate([start[:6], start[6:] / spread_m]) if spread_m else start[:6]
        scale = [0.1, 0.1, 0.1, 0.3, 0.3, 0.03, *np.ones(len(begin) - 6)]
        found = least_squares(misses, begin, x_scale=scale, ftol=1e-6, xtol=1e-6, max_nfev=STEPS)
        values = whole(found.x)
        slope = np.asarray(found.jac, dtype=np.float64)
        covariance, turn = np.linalg.pinv(slope.T @ slope)[:6, :6], _plane_slope(values[:6])
        inverse = _inverse_plane(values)
        distance_m = 1.0 / float(np.linalg.norm(inverse))
        plane = Plane(inverse * distance_m, distance_m, turn @ covariance @ turn.T, math.exp(values[5]))
        return _Fit(float(found.cost), values, plane)

    def rope_px(self, values: Array) -> Array:
        """By how much (n,) the ball is farther from the tie than the rope is long."""
        depth = self._depth_m(values)
        length = np.linalg.norm(depth[:, None] * self.sights.rays - _tie(values), axis=1)
        return np.asarray((length - self.rope_m) * self.sights.focal_px / depth)

    def _depth_m(self, values: Array) -> Array:
        inverse = _inverse_plane(values)
        off = self.offsets @ values[6:] * float(np.linalg.norm(inverse))
        return np.asarray((1.0 + off) / (self.sights.rays @ inverse))


def fuse(plane: Plane, sights: SizedSights) -> FusedDepth:
    """Depth from plane and size together, each by its covariance.

    How far off the plane the ball is at time t is a process of mean 0 with the covariance s^2 (1 + d) exp(-d),
    d = sqrt(3) |t - t'| / OFF_PLANE_LENGTH_S; s is the most likely one of OFF_PLANE_M. The size's depth minus the
    plane's is that process over normal . ray, and noise; the plane's own error is common to all and is added after.
    """
    flat, slant = plane.depth_m(sights.rays), sights.rays @ plane.normal
    apart, noise = _apart(plane, sights)
    spread_m = _spread_m(plane, sights)
    off, sigma = np.empty_like(apart), np.empty_like(apart)
    for one in _pieces(len(sights.t_s)):
        prior = spread_m**2 * _matern(sights.t_s[one], sights.t_s[one])
        gain = np.linalg.solve(prior + np.diag(noise[one] ** 2), prior).T
        off[one] = gain @ apart[one]
        sigma[one] = np.sqrt(np.maximum(np.diagonal(prior - gain @ prior), 0.0))
    return FusedDepth(flat + off / slant, np.hypot(plane.sigma_m(sights.rays), sigma / np.abs(slant)), off, sigma)


def _apart(plane: Plane, sights: SizedSights) -> tuple[Array, Array]:
    """How far off the plane the ball's size puts it (n,) [m], and the standard deviation of that."""
    slant = sights.rays @ plane.normal
    apart = (plane.size * sights.depth_m - plane.depth_m(sights.rays)) * slant
    return apart, np.abs(slant) * plane.size * sights.sigma_m


def _spread_m(plane: Plane, sights: SizedSights) -> float:
    """The most likely s of ``fuse``."""
    apart, noise = _apart(plane, sights)
    pieces = list(_pieces(len(sights.t_s)))
    cost = [sum(_cost(spread, sights.t_s[one], apart[one], noise[one]) for one in pieces) for spread in OFF_PLANE_M]
    return float(OFF_PLANE_M[int(np.argmin(cost))])


def scatter(values: Array) -> float:
    """Standard deviation of the noise in a smooth series (n,), from its third differences."""
    if len(values) < 8:
        return 0.0
    return float(np.median(np.abs(np.diff(values, n=3)))) / 0.6745 / math.sqrt(20.0)


def _tie(values: Array) -> Array:
    return np.asarray(math.exp(values[2]) * np.array([values[0], values[1], 1.0]))


def _inverse_plane(values: Array) -> Array:
    """normal / distance (3,)."""
    normal = np.array([values[3], values[4], 1.0])
    return np.asarray(normal / float(normal @ _tie(values)))


def _plane_slope(values: Array) -> Array:
    """d(normal / distance) / d(values) (3, 6), by differences."""
    step = 1e-6
    columns = [_inverse_plane(values + step * one) - _inverse_plane(values - step * one) for one in np.eye(6)]
    return np.asarray(np.column_stack(columns) / (2 * step))


def _soft(miss: Array) -> Array:
    """Residuals whose squares are Cauchy's loss with the scale 3: those far off hardly count."""
    return np.asarray(np.sign(miss) * 3.0 * np.sqrt(np.log1p((miss / 3.0) ** 2)))


def _circle_middle(pixels: Array, radius_px: float) -> Array:
    """The middle (2,) of a circle of ``radius_px`` through ``pixels`` (n, 2), above them if both fit."""
    start = pixels.mean(axis=0) - [0.0, radius_px]

    def misses(middle: Array) -> Array:
        return np.asarray(np.linalg.norm(pixels - middle, axis=1) - radius_px)

    found = least_squares(misses, start, loss="soft_l1")
    return np.asarray(found.x)


def _pieces(n: int) -> Iterator[slice]:
    count = max(1, math.ceil(n / PIECE))
    edges = np.linspace(0, n, count + 1).round().astype(int)
    return (slice(a, b) for a, b in pairwise(edges))


def _matern(one_s: Array, other_s: Array) -> Array:
    d = math.sqrt(3.0) * np.abs(one_s[:, None] - other_s) / OFF_PLANE_LENGTH_S
    return np.asarray((1.0 + d) * np.exp(-d))


def _cost(spread: float, t_s: Array, apart: Array, noise: Array) -> float:
    """Minus twice the log likelihood of ``apart``."""
    covariance = spread**2 * _matern(t_s, t_s) + np.diag(noise**2)
    factor = np.linalg.cholesky(covariance)
    white = np.linalg.solve(factor, apart)
    return float(white @ white) + 2.0 * float(np.log(np.diagonal(factor)).sum())
