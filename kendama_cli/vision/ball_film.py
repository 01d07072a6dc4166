"""The ball in the film of one camera: candidates in every frame, then the motion that explains most of them."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from itertools import islice

import numpy as np

from kendama_cli.schema.arrays import Array
from kendama_cli.vision.camera_model import CameraModel
from kendama_cli.vision.image_track import TrackedBall, track
from kendama_cli.vision.interface import Detector, Image, Sighting

CANDIDATES = 6
BESIDE_FRAMES = 3
"""Sightings so many frames away tell the direction of a streak."""


@dataclass(frozen=True)
class FilmTrack:
    """The ball's sightings in one film: frame number, time [s], centre (n, 2) [px], its covariance (n, 2, 2) [px^2],
    radius [px] and score of each frame where it was seen; and the way (n, 2) [px] that it moved while the shutter was
    open, in the direction of the frames beside it, not a number where the frame shows no streak."""

    name: str
    frame: Array
    t_s: Array
    centre_px: Array
    covariance_px2: Array
    radius_px: Array
    score: Array
    streak_px: Array

    def exposed(self, camera: CameraModel) -> FilmTrack:
        """With the frames' times turned into those at which ``camera`` exposed the ball's rows."""
        return replace(self, t_s=camera.exposed_s(self.t_s, self.centre_px))


def film_track(name: str, frames: Iterable[tuple[float, Image]], detector: Detector, threshold: float) -> FilmTrack:
    """Track the ball through ``frames``, each with its time [s]."""
    times: list[float] = []
    candidates: list[Sequence[Sighting]] = []
    for t_s, pixels in frames:
        times.append(t_s)
        candidates.append(list(islice(detector.candidates(pixels), CANDIDATES)))
    seen = [one for one in track(candidates, threshold) if one is not None]
    return FilmTrack(
        name,
        np.array([one.frame for one in seen], dtype=np.float64),
        np.array([times[one.frame] for one in seen]),
        np.array([one.sighting.centre_px for one in seen]).reshape(-1, 2),
        np.array([one.sighting.covariance_px2 for one in seen]).reshape(-1, 2, 2),
        np.array([one.sighting.radius_px for one in seen]),
        np.array([one.sighting.score for one in seen]),
        _streaks(seen),
    )


def _streaks(seen: Sequence[TrackedBall]) -> Array:
    """The ways (n, 2) within the exposures, turned the way in which the ball moves on from frame to frame."""
    ways = np.full((len(seen), 2), np.nan)
    for i, one in enumerate(seen):
        if one.sighting.streak is not None:
            near = [k for k in (i - 1, i + 1) if 0 <= k < len(seen) and abs(seen[k].frame - one.frame) <= BESIDE_FRAMES]
            first, last = (seen[k].sighting.centre_px for k in (min([i, *near]), max([i, *near])))
            way = one.sighting.streak.way_px
            ways[i] = -way if float(way @ (last - first)) < 0 else way
    return ways
