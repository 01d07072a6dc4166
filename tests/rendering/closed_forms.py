"""Shapes that rays hit, in numpy and one by one: what the compiled kernel is held against.

A ray is p = o + t d; ``origins`` are (3,) or (n, 3), ``directions`` (n, 3) of any length; a miss has t = inf.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from kendama_cli.schema.arrays import Array

NEAR = 1e-6
"""A ray that starts on a surface does not hit that surface again."""


@dataclass(frozen=True)
class Hits:
    """First intersections of n rays with a shape: ``t`` (n,), outward ``normals`` (n, 3), of no meaning at a miss."""

    t: Array
    normals: Array


@dataclass(frozen=True)
class Sphere:
    """A ball."""

    center_m: Array
    radius_m: float

    def hit(self, origins: Array, directions: Array) -> Hits:
        apart = origins - self.center_m
        t = _first_root(_dot(directions, directions), _dot(directions, apart), _dot(apart, apart) - self.radius_m**2)
        return Hits(t, (apart + _finite(t)[:, None] * directions) / self.radius_m)


@dataclass(frozen=True)
class Capsule:
    """A cylinder with round ends from ``a_m`` to ``b_m``: a link of the arm, a piece of rope."""

    a_m: Array
    b_m: Array
    radius_m: float

    def hit(self, origins: Array, directions: Array) -> Hits:
        axis = self.b_m - self.a_m
        length2 = float(axis @ axis)
        apart = origins - self.a_m
        if length2 < 1e-18:
            return Sphere(self.a_m, self.radius_m).hit(origins, directions)
        along_d, along_o = directions @ axis / length2, apart @ axis / length2
        d, o = directions - np.multiply.outer(along_d, axis), apart - np.multiply.outer(along_o, axis)
        t = _first_root(_dot(d, d), _dot(d, o), _dot(o, o) - self.radius_m**2)
        part = along_o + _finite(t) * along_d
        t = np.where((part >= 0) & (part <= 1), t, np.inf)
        aa = _dot(directions, directions)
        for end in (self.a_m, self.b_m):
            gap = origins - end
            t = np.minimum(t, _first_root(aa, _dot(directions, gap), _dot(gap, gap) - self.radius_m**2))
        point = apart + _finite(t)[:, None] * directions
        part = np.clip(point @ axis / length2, 0.0, 1.0)
        return Hits(t, (point - part[:, None] * axis) / self.radius_m)


@dataclass(frozen=True)
class OpenCup:
    """A round cup: wall, floor and rim; its inside can be looked into."""

    tie_m: Array
    rotation: Array
    radius_m: float
    depth_m: float
    wall_m: float

    def hit(self, origins: Array, directions: Array) -> Hits:
        o, d = (origins - self.tie_m) @ self.rotation, directions @ self.rotation
        outer, inner = self.radius_m + self.wall_m, self.radius_m
        aa, ab, bb = _dot(d[:, :2], d[:, :2]), _dot(d[:, :2], o[..., :2]), _dot(o[..., :2], o[..., :2])
        t = np.full(len(d), np.inf)
        normal = np.zeros((len(d), 3))

        def take(candidate: Array, inside: NDArray[np.bool_], outward: Array | float, up: float) -> None:
            nonlocal t
            better = inside & (candidate < t) & (candidate > NEAR)
            t = np.where(better, candidate, t)
            point = o + _finite(candidate)[:, None] * d
            side = np.column_stack([point[:, 0] * outward, point[:, 1] * outward, np.full(len(d), up)])
            normal[better] = side[better]

        def height(candidate: Array) -> Array:
            return np.asarray(o[..., 2] + _finite(candidate) * d[:, 2])

        near = _first_root(aa, ab, bb - outer**2)
        take(near, (height(near) >= 0) & (height(near) <= self.depth_m), 1 / outer, 0.0)
        far = _last_root(aa, ab, bb - inner**2)
        take(far, (height(far) >= self.wall_m) & (height(far) <= self.depth_m), -1 / inner, 0.0)
        with np.errstate(divide="ignore", invalid="ignore"):
            for level, low, high, up in (
                (self.depth_m, inner, outer, 1.0),
                (self.wall_m, 0.0, inner, 1.0),
                (0.0, 0.0, outer, -1.0),
            ):
                plane = np.nan_to_num((level - o[..., 2]) / d[:, 2], nan=np.inf, posinf=np.inf, neginf=np.inf)
                ring = np.hypot(o[..., 0] + _finite(plane) * d[:, 0], o[..., 1] + _finite(plane) * d[:, 1])
                take(plane, (ring >= low) & (ring <= high), 0.0, up)
        return Hits(t, normal @ self.rotation.T)


def _dot(a: Array, b: Array) -> Array:
    return np.asarray(np.einsum("...i,...i->...", a, b))


def _finite(t: Array) -> Array:
    return np.where(np.isfinite(t), t, 0.0)


def _first_root(a: Array, half_b: Array, c: Array) -> Array:
    """The smaller positive t of a t^2 + 2 half_b t + c = 0, from outside the solid; inf where there is none."""
    discriminant = half_b * half_b - a * c
    with np.errstate(divide="ignore", invalid="ignore"):
        t = (-half_b - np.sqrt(np.maximum(discriminant, 0.0))) / a
    return np.where((discriminant > 0) & (t > NEAR), t, np.inf)


def _last_root(a: Array, half_b: Array, c: Array) -> Array:
    """The larger positive t, where a ray leaves the solid; inf where there is none."""
    discriminant = half_b * half_b - a * c
    with np.errstate(divide="ignore", invalid="ignore"):
        t = (-half_b + np.sqrt(np.maximum(discriminant, 0.0))) / a
    return np.where((discriminant > 0) & (t > NEAR), t, np.inf)
