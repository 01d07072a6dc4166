"""The circle of a ball of several colours whose radius in the image is known.

A seam inside the ball's rim looks like rim, and the part of one colour has a circle of its own. With the radius given,
hardly more than one place agrees with what is truly rim; the rest are outliers.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from kendama_cli.schema.arrays import Array
from kendama_cli.vision.circle_fit import DESIGN, STEP_PX, Disc, Edges, Pixels, outermost_edges, profile_along_rays
from kendama_cli.vision.interface import Sighting

EDGE_PX = 3.0
"""The outermost colour's own light is sought so far within its edge: further in lies the next colour."""
RADIUS_SIGMA = 0.01
"""Standard deviation of the given radius over itself: two cameras tell the depth to some millimetres."""
RAY_SIGMA_PX = 0.3
"""Standard deviation of one ray's edge beside which that of the radius counts."""
WIDEST_PX, NARROWER, NARROWEST_PX = 2.0, 1.4, 0.2
"""The cost's scale: at first, by what it shrinks, and at least."""
NOISE_SCALES = 2.5
"""It shrinks to so many standard deviations of what it takes as rim."""
STEPS = 2
"""Of weighted least squares at each scale."""
STRONG = 0.9
"""Quantile of the rays' contrasts against which each ray's is held: noise shifts a faint edge more."""
MOST_BLUR_PX = 2.0
"""What is softer has moved."""
FEWEST = 10
"""So many rays with an edge near the circle are enough."""
CENTRED_PX, ROUNDS = 0.05, 3
CORRELATED = 4.0
"""So many rays count for one in the covariance: neighbours share pixels and shade. Measured on rendered balls."""
SIGMA_FLOOR_PX = 0.05


class _Fit(NamedTuple):
    """Shift (2,) of the centre, radius, covariance (2, 2), and the part of the edges' weight that is rim."""

    shift: Array
    radius: float
    covariance: Array
    share: float


def sized_circle(more: Pixels, disc: Disc, least: float) -> Sighting | None:
    """The circle about ``disc``, whose radius is right to RADIUS_SIGMA, in the difference in light ``more`` (h, w, 3)
    from a background; below ``least`` nothing differs. None where too few rays show an edge.

    With e the distances of the outermost edges from the circle and w their weights, the cost is Geman and McClure's
    (1987), sum w e^2 s^2 / (s^2 + e^2), beside that of the radius. Its scale s shrinks stepwise to the noise's
    (graduated non-convexity, Blake and Zisserman 1987; weights as of Black and Rangarajan 1996). The score is the part
    of the edges' weight that is rim.
    """
    centre, found = np.asarray(disc.centre, dtype=np.float64), None
    for _ in range(ROUNDS):
        steps, profile, usable = profile_along_rays(more, Disc(centre, disc.radius, is_sized=True))
        edges = outermost_edges(steps, profile, usable, least, EDGE_PX)
        near = edges.found & (np.abs(edges.reach - disc.radius) < WIDEST_PX)
        if int(near.sum()) < FEWEST:
            return None
        # half of a blurred disc's height lies further in than its rim, by the blur's variance over twice the radius
        blur = _blur_px(steps, edges, near)
        found = _fit(edges, disc.radius, disc.radius - blur**2 / (2 * disc.radius))
        centre = centre + found.shift
        if float(np.hypot(*found.shift)) < CENTRED_PX:
            break
    return None if found is None else Sighting(centre, found.covariance, found.radius, found.share, painted=True)


def _blur_px(steps: Array, edges: Edges, near: NDArray[np.bool_]) -> float:
    """Standard deviation of the edges' blur, were it normal, from the slope where the stronger half of them falls."""
    at = np.clip(((edges.reach - steps[0]) / STEP_PX).astype(int), 1, len(steps) - 3)
    every = np.arange(len(at))
    slope = (edges.signal[every, at - 1] - edges.signal[every, at + 2]) / (3 * STEP_PX)
    strong = near & (edges.contrast >= np.median(edges.contrast[near]))
    blur = edges.contrast[strong] / (np.sqrt(2 * np.pi) * np.maximum(slope[strong], 1e-3))
    return min(float(np.median(blur)), MOST_BLUR_PX)


def _fit(edges: Edges, size: float, radius: float) -> _Fit:
    """The circle through ``edges``, of ``radius`` but for RADIUS_SIGMA of the ball's ``size`` in the image."""
    reach, contrast = (np.where(edges.found, one, 0.0) for one in (edges.reach, edges.contrast))
    known = np.minimum(contrast / np.quantile(contrast[edges.found], STRONG), 1.0) ** 2
    prior = np.diag([1e-6, 1e-6, (RAY_SIGMA_PX / (RADIUS_SIGMA * size)) ** 2])
    circle, scale = np.array([0.0, 0.0, radius]), WIDEST_PX
    while True:
        for _ in range(STEPS):
            weighted = DESIGN * (known * _rim(reach - DESIGN @ circle, scale))[:, None]
            inverse = np.linalg.inv(weighted.T @ DESIGN + prior)
            circle = inverse @ (reach @ weighted + prior[2] * radius)
        left = reach - DESIGN @ circle
        weight = known * _rim(left, scale)
        variance = float(weight @ left**2) / max(float(weight.sum()), 1e-9)
        target = max(NOISE_SCALES * float(np.sqrt(variance)), NARROWEST_PX)
        if scale <= target:
            break
        scale = max(scale / NARROWER, target)
    covariance = CORRELATED * variance * inverse[:2, :2] + np.eye(2) * SIGMA_FLOOR_PX**2
    return _Fit(circle[:2], float(circle[2]), np.asarray(covariance), float(weight.sum() / known.sum()))


def _rim(left: Array, scale: float) -> Array:
    """Geman and McClure's weight of distances ``left`` (n,) from the circle."""
    return np.asarray((scale**2 / (scale**2 + left**2)) ** 2)
