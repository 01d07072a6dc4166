"""The circle through a ball's outline, to a part of a pixel, from a rough place of it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from kendama_cli.schema.arrays import Array
from kendama_cli.vision.interface import Image, Sighting

DIRECTIONS = 48
STEP_PX = 0.5
CUTOFFS_PX = (1.5, 1.0, 0.6, 0.4)
"""Outline points farther than this from the circle are left out, pass by pass; noise and blur stay within 0.3 px."""
SIZED_CUTOFFS_PX = (2.0, *CUTOFFS_PX)
SIZED_RAYS, SIZED_LAST = 48.0, 8.0
"""As many rays a known radius counts for while outliers are left out, and in the last pass: blur makes circles look
smaller by up to 0.5 px."""
SIZED_PART, SIZED_OUTLINE = 0.1, 0.4
"""A known radius is right to this part; so much of the outline is enough where the radius is known."""
MIN_CONTRAST = 12.0
"""Grey levels between ball and surroundings along one direction; below, that direction shows no outline."""
EDGE_PX = 4.0
"""A blurred edge is no wider."""
TURNED = 0.1
"""What falls by this part of its height further in is another colour's."""
RIM = 6
"""Samples at a ray's end that show the surroundings."""
CENTRED_PX = 0.4
"""A circle found from rays that meet so near to its centre is final: what is left is of second order, 0.01 px."""
ROUNDS = 4
_ANGLES = 2 * np.pi * np.arange(DIRECTIONS) / DIRECTIONS
RAYS = np.column_stack([np.cos(_ANGLES), np.sin(_ANGLES)])
"""Unit vectors (n, 2) of the rays."""
DESIGN = np.column_stack([RAYS, np.ones(DIRECTIONS)])
"""About the rays' common centre the distance to a circle is DESIGN @ (shift u, shift v, radius)."""


@dataclass(frozen=True)
class Disc:
    """A rough place of the ball: ``centre`` (2,) and ``radius`` [px], known to a few per cent if ``is_sized``."""

    centre: Array
    radius: float
    is_sized: bool = False


Pixels = Image | NDArray[np.float32]
"""An image, or its signed difference from another."""
Outline = Callable[[Array, Array, NDArray[np.bool_]], tuple[Array, NDArray[np.bool_]]]
"""From steps (s,) along the rays, the image there (n, s, 3) and which rays (n,) lie in the image to the outline's
distance on each and where it was found."""


class CircleFit:
    """Fits circles to outlines of which at least the part ``min_outline`` must be found.

    The outline is sought on rays from the disc's centre, by ``outline``. Rays that end at the image's border, on an
    occluder or off the circle are left out, and the covariance sigma^2 (J^T J)^-1 of the circle's fit grows with every
    ray that is missing; it is at least ``sigma_floor_px``'s.
    """

    def __init__(self, *, min_radius_px: float, min_outline: float, sigma_floor_px: float) -> None:
        self._min_radius_px, self._min_outline, self._sigma_floor_px = min_radius_px, min_outline, sigma_floor_px

    def circle(self, pixels: Pixels, disc: Disc, outline: Outline) -> Sighting | None:
        """The circle about ``disc`` in ``pixels`` (h, w, 3), or None; its score is the part of the outline found.

        It is fitted again from its own centre until rays and outline meet at right angles.
        """
        for _ in range(ROUNDS):
            steps, profile, usable = profile_along_rays(pixels, disc)
            if usable.sum() < self._least(disc):
                return None
            found = self._fit(disc, *outline(steps, profile, usable))
            if found is None:
                return None
            moved = float(np.hypot(*(found.centre_px - disc.centre)))
            differs = abs(found.radius_px - disc.radius)
            if disc.is_sized and differs > SIZED_PART * disc.radius:
                return None
            if moved < CENTRED_PX and differs < 0.25 * found.radius_px:
                return found if found.radius_px >= self._min_radius_px else None
            disc = Disc(found.centre_px, disc.radius if disc.is_sized else found.radius_px, disc.is_sized)
        return None

    def _least(self, disc: Disc) -> float:
        """The least number of rays that must meet the outline."""
        return max(5.0, (SIZED_OUTLINE if disc.is_sized else self._min_outline) * DIRECTIONS)

    def _fit(self, disc: Disc, reach: Array, usable: NDArray[np.bool_]) -> Sighting | None:
        """The circle through outline points at distance ``reach`` (n,) from the disc's centre, outliers left out.

        About the rays' common centre the distance is linear in the circle's three unknowns:
        reach = radius + direction . shift. A radius that is known is one more equation.
        """
        least = self._least(disc)
        seen = reach[usable]
        if len(seen) < least:
            return None
        # what hides the ball makes rays shorter, never longer; half a disc still has the whole disc's outer circle
        most = int(0.7 * len(seen))
        circle = np.array([0.0, 0.0, disc.radius if disc.is_sized else np.partition(seen, most)[most]])
        cutoffs = SIZED_CUTOFFS_PX if disc.is_sized else CUTOFFS_PX
        for cutoff in cutoffs:
            kept = usable & (np.abs(reach - DESIGN @ circle) < cutoff)
            count = int(kept.sum())
            if count < least:
                return None
            weighted = DESIGN * kept[:, None]
            rays = 0.0 if not disc.is_sized else SIZED_LAST if cutoff == cutoffs[-1] else SIZED_RAYS
            inverse = np.linalg.inv(weighted.T @ DESIGN + np.diag([0.0, 0.0, rays]))
            circle = inverse @ (reach @ weighted + [0.0, 0.0, rays * disc.radius])
        left = (reach - DESIGN @ circle)[kept]
        variance = float(left @ left) / max(count - 3, 1)
        covariance = inverse[:2, :2] * variance + np.eye(2) * self._sigma_floor_px**2
        return Sighting(disc.centre + circle[:2], np.asarray(covariance), float(circle[2]), count / DIRECTIONS)


def profile_along_rays(pixels: Pixels, disc: Disc) -> tuple[Array, Array, NDArray[np.bool_]]:
    """What lies along every direction from the disc's centre: steps, the image there, which rays are inside it."""
    height, width = pixels.shape[:2]
    radius = max(disc.radius, 1.0)
    steps = np.arange(0.5 * radius, 1.35 * radius + 3.0 + STEP_PX, STEP_PX)
    reach = float(steps[-1]) + 2
    left, top = (max(int(middle - reach), 0) for middle in disc.centre)
    right, bottom = (int(middle + reach) + 2 for middle in disc.centre)
    crop = pixels[top:bottom, left:right]
    if crop.size == 0:
        return steps, np.zeros((DIRECTIONS, len(steps), 3)), np.zeros(DIRECTIONS, dtype=np.bool_)
    columns, rows = ((disc.centre - (left, top))[:, None, None] + RAYS.T[:, :, None] * steps).astype(np.float32)
    ends = RAYS * steps[-1] + disc.centre
    usable = ((ends >= 0) & (ends <= (width - 1, height - 1))).all(axis=1)
    return steps, np.asarray(cv2.remap(crop, columns, rows, cv2.INTER_LINEAR), dtype=np.float32), usable


def through_contrast(steps: Array, profile: Array, usable: NDArray[np.bool_]) -> tuple[Array, NDArray[np.bool_]]:
    """An Outline of a ball of one colour.

    It lies where the image, projected on the line in colour space from surroundings to ball, falls through half of
    that ray's own contrast, so that shading does not shift it.
    """
    # the rays begin at half of the radius: what lies before 0.7 of it is the ball
    core = int(0.4 * float(steps[0]) / STEP_PX) + 1
    low, high = profile[:, -RIM:].sum(axis=1) / RIM, profile[:, :core].sum(axis=1) / core
    contrast = usable @ (high - low)
    length = float(np.linalg.norm(contrast))
    if length < MIN_CONTRAST * usable.sum():
        return np.zeros(len(usable)), np.zeros(len(usable), dtype=np.bool_)
    contrast /= length
    low, high, signal = low @ contrast, high @ contrast, profile @ contrast
    # each ray falls through the middle between its own two ends
    return _falls(steps, signal, (low + high) / 2, usable & (high - low > MIN_CONTRAST), last=False)


class Edges(NamedTuple):
    """The outermost edge on each ray (n,): its distance, whether one was found, the ``contrast`` of its colour, and how
    much of that colour lies at each step of the ray (n, s), the ``signal``."""

    reach: Array
    found: NDArray[np.bool_]
    contrast: Array
    signal: Array


def outermost(least: float) -> Outline:
    """An Outline in the signed difference from a background, of a ball of any colours: the outermost colour's edge."""

    def found(steps: Array, profile: Array, usable: NDArray[np.bool_]) -> tuple[Array, NDArray[np.bool_]]:
        edges = outermost_edges(steps, profile, usable, least, EDGE_PX)
        return edges.reach, edges.found

    return found


def outermost_edges(steps: Array, profile: Array, usable: NDArray[np.bool_], least: float, within_px: float) -> Edges:
    """The edges of the outermost colour in the signed difference ``profile`` (n, s, 3) from a background.

    From outside inward, an edge lies where the difference first reaches half of that colour's own, which is the most
    that it comes to within ``within_px`` before it turns to another colour; below ``least`` nothing differs. Where a
    part of the ball looks like what is behind it, the edge is not there.
    """
    differs = np.abs(profile).max(axis=2) > least
    n, count = differs.shape
    every, last = np.arange(n), count - 1 - differs[:, ::-1].argmax(axis=1)
    colour = profile[every, np.maximum(last - 1, 0)]
    colour /= np.maximum(np.linalg.norm(colour, axis=1), 1e-9)[:, None]
    signal = (profile @ colour[:, :, None])[:, :, 0]
    inward = np.maximum(last[:, None] - np.arange(round(within_px / STEP_PX) + 1), 0)
    reached = signal[every[:, None], inward]
    so_far = np.maximum.accumulate(reached, axis=1)
    turned = np.logical_or.accumulate(reached < so_far - np.maximum(least / 2, TURNED * so_far), axis=1)
    top = np.where(turned, -np.inf, reached).max(axis=1)
    some = usable & (top > least) & (last < count - 1)
    reach, found = _falls(steps, signal, top / 2, some, last=True)
    return Edges(reach, found, top, signal)


def _falls(
    steps: Array, signal: Array, level: Array, usable: NDArray[np.bool_], *, last: bool
) -> tuple[Array, NDArray[np.bool_]]:
    """Where each ray's ``signal`` (n, s) falls through its ``level`` (n,), first or last, and whether it does."""
    above = signal > level[:, None]
    falls = above[:, :-1] & ~above[:, 1:]
    at = falls.shape[1] - 1 - falls[:, ::-1].argmax(axis=1) if last else falls.argmax(axis=1)
    every = np.arange(len(signal))
    found = usable & falls[every, at]
    before, after = signal[every, at], signal[every, at + 1]
    drop = np.where(found, before - after, 1.0)
    return steps[at] + STEP_PX * (before - level) / drop, found
