"""Check that all views of a camera were taken through one lens at one zoom.

Views of two lenses fit a lens between them, with a small standard deviation. So each view gets a focal length and a
centre of its own, near the lens of the views that agree, and is told where these lie far from theirs: farther than its
corners' noise and the scatter of the others explain.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2

from kendama_cli.plugins.calibration.intrinsics import MIN_VIEWS, View, fit_lens
from kendama_cli.schema.arrays import Array
from kendama_cli.vision.cameras.radial_lens import RadialLens

POSE = 6
OWN = 3
"""Numbers that each view fits by itself: the focal length's factor, and the centre's shift (x, y) [px]."""
AGREES = 20.0
"""Squared distance of a view to the others' mean, in their scatter, up to which it agrees with them."""
FOREIGN = 40.0
"""The same, from which one of several views is of another lens: good sets, rendered and real, stay below it."""
FOREIGN_ALONE = 150.0
"""The same for a single view: where an image cuts the board its corners may be off together."""
LEAST_AGREEING = 8
ROUNDS = 8
MOST_SEEDS = 40

Mask = NDArray[np.bool_]


@dataclass(frozen=True)
class OwnLenses:
    """Numbers of the lens by each of v views alone (v, 3), and their information (v, 3, 3)."""

    values: Array
    information: Array

    def mean(self, chosen: Mask | slice = slice(None)) -> Array:
        """Return the numbers (3,) on which the chosen views agree best."""
        information = self.information[chosen]
        weighted = np.einsum("vij,vj->i", information, self.values[chosen])
        return np.asarray(np.linalg.pinv(information.sum(axis=0)) @ weighted)

    def squared_distances(self, numbers: Array) -> Array:
        """Return each view's squared distance (v,) to ``numbers`` in its own standard deviations."""
        off = self.values - numbers
        return np.asarray(np.einsum("vi,vij,vj->v", off, self.information, off))


def check_one_lens(name: str, views: Sequence[View], corners_m: Sequence[Array], size: tuple[int, int]) -> None:
    """Raise ValueError that names the views of camera ``name`` that another lens, zoom or camera took.

    ``corners_m`` has the seen corners (n_i, 3) of each view. Eight views or fewer are not looked at.
    """
    if len(views) <= LEAST_AGREEING:
        return
    pixels = [view.pixels for view in views]
    whole = fit_lens(name, pixels, corners_m, size).lens
    halves = _two_groups(_own_lenses(whole, pixels, corners_m))
    found = [_agreeing(name, one, pixels, corners_m, size) for one in (halves, ~halves) if one.sum() >= MIN_VIEWS]
    agreeing, distances = max(found, key=lambda one: int(one[0].sum()))
    foreign = ~agreeing
    least = FOREIGN if foreign.sum() > 1 else FOREIGN_ALONE
    if agreeing.sum() < LEAST_AGREEING or not distances[foreign].max(initial=0.0) > least:
        return
    lens = fit_lens(name, _of(pixels, agreeing), _of(corners_m, agreeing), size).lens
    if foreign.sum() >= MIN_VIEWS:
        other = fit_lens(name, _of(pixels, foreign), _of(corners_m, foreign), size).lens
        focal_px, x, y = other.fx, other.cx - lens.cx, other.cy - lens.cy
    else:
        factor, x, y = _own_lenses(lens, pixels, corners_m).mean(foreign).tolist()
        focal_px = factor * lens.fx
    names = ", ".join(f"'{view.name}'" for view, is_foreign in zip(views, foreign, strict=True) if is_foreign)
    raise ValueError(
        f"camera '{name}': {foreign.sum()} of its {len(views)} views are of another lens, zoom or camera (focal length "
        f"{focal_px:.0f} px for {lens.fx:.0f}, centre {x:+.0f}, {y:+.0f} px beside): {names}; leave them out"
    )


def _agreeing(
    name: str, start: Mask, pixels: Sequence[Array], corners_m: Sequence[Array], size: tuple[int, int]
) -> tuple[Mask, Array]:
    """Return the views that one lens explains, grown from ``start``, and all views' squared distances to it."""
    chosen = start
    for _ in range(ROUNDS):
        lens = fit_lens(name, _of(pixels, chosen), _of(corners_m, chosen), size).lens
        own = _own_lenses(lens, pixels, corners_m)
        squared = own.squared_distances(own.mean(chosen))
        distances = squared / max(1.0, float(np.median(squared[chosen]) / chi2.median(OWN)))
        agreeing = distances < AGREES
        if agreeing.sum() < MIN_VIEWS or (agreeing == chosen).all():
            break
        chosen = agreeing
    return chosen, distances


def _of(values: Sequence[Array], chosen: Mask) -> list[Array]:
    return [value for value, one in zip(values, chosen, strict=True) if one]


def _own_lenses(lens: RadialLens, pixels: Sequence[Array], corners_m: Sequence[Array]) -> OwnLenses:
    """Fit each view's own numbers by one step of Gauss and Newton from ``lens``, with the board's pose free."""
    values, information, variances = [], [], []
    for seen, points_m in zip(pixels, corners_m, strict=True):
        _, turn, shift = cv2.solvePnP(points_m, seen, lens.matrix, lens.distortion)
        turn, shift = cv2.solvePnPRefineLM(points_m, seen, lens.matrix, lens.distortion, turn, shift)
        projected, slope = lens.posed(points_m, turn, shift)
        focal = slope[:, POSE] * lens.fx + slope[:, POSE + 1] * lens.fy
        own = np.column_stack([focal, slope[:, POSE + 2 : POSE + 4]])
        by_pose, _ = np.linalg.qr(slope[:, :POSE])
        own, residuals = (one - by_pose @ (by_pose.T @ one) for one in (own, (seen - projected).ravel()))
        step = np.linalg.pinv(own.T @ own, rcond=1e-10) @ (own.T @ residuals)
        values.append(step + np.array([1.0, 0.0, 0.0]))
        information.append(own.T @ own)
        variances.append(float(((residuals - own @ step) ** 2).sum()) / max(residuals.size - POSE - OWN, 1))
    noise = np.maximum(variances, max(float(np.median(variances)), 1e-12))  # a cut board's corners are worse
    return OwnLenses(np.array(values), np.array(information) / noise[:, None, None])


def _two_groups(own: OwnLenses) -> Mask:
    """Split the views into the two groups that agree best within themselves (k-means from every pair of views)."""
    middle, weak = own.mean(), 0.3 * own.information.mean(axis=0)  # a view alone may not tell the focal length
    towards = own.information @ own.values[..., None] + (weak @ middle)[:, None]
    seeds = (np.linalg.pinv(own.information + weak) @ towards)[..., 0]
    best, least = np.ones(len(seeds), dtype=bool), np.inf
    for pair in combinations(range(0, len(seeds), 1 + len(seeds) // MOST_SEEDS), 2):
        centres = seeds[list(pair)]
        for _ in range(ROUNDS):
            distances = np.array([own.squared_distances(centre) for centre in centres])
            first = distances[0] < distances[1]
            if first.all() or not first.any():
                break
            centres = np.array([own.mean(first), own.mean(~first)])
            if (total := float(distances.min(axis=0).sum())) < least:
                best, least = first, total
    return best
