"""The ball's places in the world from its tracks in calibrated films: two films or more, or one and its known size."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize_scalar

from kendama_cli.plugins.films.ball_film import FilmTrack
from kendama_cli.schema.arrays import Array
from kendama_cli.vision.cameras.camera_model import CameraModel
from kendama_cli.vision.cameras.triangulation import RayConstraints, ray_constraints, triangulate
from kendama_cli.vision.prediction.tracker import sphere_centre

LONGEST_OFFSET_S = 2.0
GAP_FRAMES = 3.0
RADIUS_SIGMA = 0.5
"""Standard deviation of a radius that was seen [px], where a detector says none."""
FEWEST = 8
MEDIAN_CHI_SQUARE = 0.455
"""Median of chi-square with one degree of freedom."""


@dataclass(frozen=True)
class FilmPositions:
    """Places (n, 3) [m] of the ball at times (n,) [s] of the first film, with covariances (n, 3, 3) [m^2], and by how
    much each further film's clock is ahead of the first's (films - 1,) [s]; of several films what is left over of the
    sights a degree of freedom (n,), by their noise."""

    t_s: Array
    position_m: Array
    covariance_m2: Array
    offset_s: Array
    chi_square: Array | None = None

    @property
    def misfit_sigmas(self) -> float | None:
        """Typical distance of the films' rays from each other over its standard deviation; None for one film."""
        return None if self.chi_square is None else float(np.sqrt(np.median(self.chi_square) / MEDIAN_CHI_SQUARE))


def clock_offsets(tracks: Sequence[FilmTrack], cameras: Sequence[CameraModel]) -> Array:
    """Return the lead of each further film's clock over the first's (films - 1,) [s]: where the rays meet best.

    Raises ValueError where two films never show the ball at one moment.
    """
    (first, model), *others = _all_seen(tracks, cameras)
    return np.array([_offset_s(first, model, *other) for other in others])


def from_several(tracks: Sequence[FilmTrack], cameras: Sequence[CameraModel], offset_s: Array) -> FilmPositions:
    """Triangulate the first film's sightings with the others', interpolated to the same moments.

    ``offset_s`` (films - 1,) are those of ``clock_offsets``, or 0. Raises ValueError where the films see the ball
    together at too few moments.
    """
    (first, model), *others = _all_seen(tracks, cameras)
    times, places, covariances, left = [], [], [], []
    for i, t_s in enumerate(first.t_s):
        sights = [_sight(model, first.centre_px[i], first.radius_px[i], first.covariance_px2[i])]
        for (one, camera), ahead_s in zip(others, offset_s, strict=True):
            seen = _at(one, t_s + ahead_s)
            if seen is not None:
                sights.append(_sight(camera, *seen))
        point = triangulate(sights)
        if point is not None:
            times.append(t_s)
            places.append(point.position_m)
            covariances.append(point.covariance_m2)
            left.append(point.chi_square)
    if len(times) < FEWEST:
        raise ValueError(f"the films show the ball together at {len(times)} moments; {FEWEST} are the least")
    return FilmPositions(np.array(times), np.array(places), np.array(covariances), offset_s, chi_square=np.array(left))


def from_one(found: FilmTrack, camera: CameraModel, ball_radius_m: float) -> FilmPositions:
    """Return places by one camera, whose depth is that of a ball of ``ball_radius_m`` with the radius seen."""
    straight = [
        camera.straight(*sphere_centre(camera, centre, float(radius)))
        for centre, radius in zip(found.centre_px, found.radius_px, strict=True)
    ]
    rays = np.array([(at.x, at.y, 1.0) for at in straight]).reshape(-1, 3)
    focal_px = float(camera.optics.focal_px.mean())
    depth = _depth_m(focal_px, rays, found.radius_px, ball_radius_m)
    sigma = depth * max(RADIUS_SIGMA, _scatter(found.radius_px)) / found.radius_px
    own = np.einsum("n,ni,nj->nij", sigma**2, rays, rays)
    own[:, :2, :2] += (depth**2 / focal_px**2)[:, None, None] * found.covariance_px2
    turn = camera.world_to_camera.T
    places = camera.position_in_world_m + (depth[:, None] * rays) @ turn.T
    return FilmPositions(found.t_s, places, turn @ own @ turn.T, np.zeros(0))


def _depth_m(focal_px: float, rays: Array, radius_px: Array, radius_m: float) -> Array:
    """Return the depth of a sphere by its disc.

    A sphere of radius R at the depth Z, seen along (x, y, 1), has a disc of the mean radius
    r = f R / Z (1 + sqrt(1 + x^2 + y^2)) / 2: nearly an ellipse, longer away from the centre by the root.
    """
    longer = (1.0 + np.linalg.norm(rays, axis=1)) / 2
    return np.asarray(focal_px * radius_m * longer / radius_px)


def _scatter(values: Array) -> float:
    """Return the standard deviation of the noise in a smooth series (n,), from its third differences."""
    if len(values) < 8:
        return 0.0
    return float(np.median(np.abs(np.diff(values, n=3)))) / 0.6745 / math.sqrt(20.0)


def _all_seen(tracks: Sequence[FilmTrack], cameras: Sequence[CameraModel]) -> list[tuple[FilmTrack, CameraModel]]:
    """Return each film with its camera; raises ValueError where one shows too little."""
    seen = list(zip(tracks, cameras, strict=True))
    few = min((one for one, _ in seen), key=lambda one: len(one.t_s))
    if len(few.t_s) < FEWEST:
        raise ValueError(f"'{few.name}' shows the ball in {len(few.t_s)} frames; {FEWEST} are the least")
    return seen


def _sight(camera: CameraModel, centre_px: Array, radius_px: float, covariance_px2: Array) -> RayConstraints:
    return ray_constraints(camera, sphere_centre(camera, centre_px, float(radius_px)), covariance_px2)


def _at(found: FilmTrack, t_s: float) -> tuple[Array, float, Array] | None:
    """Centre, radius and covariance at a moment, between the sightings on both sides of it; None in a gap."""
    after = int(np.searchsorted(found.t_s, t_s))
    if after == 0 or after == len(found.t_s):
        return None
    before = after - 1
    if found.frame[after] - found.frame[before] > GAP_FRAMES:
        return None
    part = (t_s - found.t_s[before]) / (found.t_s[after] - found.t_s[before])
    near = slice(max(before - 1, 0), min(after + 2, len(found.t_s)))
    centre = found.centre_px[before] * (1 - part) + found.centre_px[after] * part
    if near.stop - near.start == 4 and found.frame[near][-1] - found.frame[near][0] == 3:
        s = found.t_s[near] - t_s
        centre = np.array([np.polynomial.Polynomial.fit(s, found.centre_px[near, k], 3)(0.0) for k in range(2)])
    return centre, float(found.radius_px[before]), found.covariance_px2[before]


def _offset_s(first: FilmTrack, model: CameraModel, other: FilmTrack, camera: CameraModel) -> float:
    """Return the lead of ``other``'s clock: where the rays to the ball pass nearest to each other."""
    period_s = float(np.median(np.diff(first.t_s)))
    grid = np.arange(-LONGEST_OFFSET_S, LONGEST_OFFSET_S + period_s, period_s)
    costs = np.array([_miss(first, model, other, camera, float(offset)) for offset in grid])
    if not np.isfinite(costs).any():
        raise ValueError(f"'{first.name}' and '{other.name}' never show the ball at one moment")
    start = float(grid[int(np.nanargmin(np.where(np.isfinite(costs), costs, np.inf)))])
    bounds = start - period_s, start + period_s
    found = minimize_scalar(
        lambda offset: _miss(first, model, other, camera, float(offset)), bounds=bounds, method="bounded"
    )
    return float(found.x)


def _miss(first: FilmTrack, model: CameraModel, other: FilmTrack, camera: CameraModel, offset_s: float) -> float:
    """Mean distance [m] between the rays of one moment, infinite with fewer than FEWEST moments in common."""
    gaps = []
    for i, t_s in enumerate(first.t_s):
        seen = _at(other, t_s + offset_s)
        if seen is None:
            continue
        a, b = _ray(model, first.centre_px[i], first.radius_px[i]), _ray(camera, seen[0], seen[1])
        normal = np.cross(a, b)
        length = float(np.linalg.norm(normal))
        if length > 1e-6:
            gaps.append(abs(float(normal @ (camera.position_in_world_m - model.position_in_world_m))) / length)
    return float(np.mean(gaps)) if len(gaps) >= FEWEST else float("inf")


def _ray(camera: CameraModel, centre_px: Array, radius_px: float) -> Array:
    at = camera.straight(*sphere_centre(camera, centre_px, float(radius_px)))
    ray = camera.world_to_camera.T @ np.array([at.x, at.y, 1.0])
    return np.asarray(ray / np.linalg.norm(ray))
