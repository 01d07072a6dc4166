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
"""Sightings so many frames away tell the direction of a streak, and with at least ARC_ROWS of them a smooth arc."""
ARC_ROWS = 5
NEAR_RADII, NEAR_PX = 0.5, 2.0
"""A sighting is on a smooth arc where it is so near to the parabola through it and those beside it."""
LEAST_MOVED_RADII, LEAST_MOVED_PX = 2.0, 10.0
"""A stretch of smooth arcs is of a ball that moves where it leads so far; a speck flickers at one place."""
LEAST_SHARE = 0.3
"""A ball's track is smooth in this share of its rows: it bounces and is handled, but does not hop about."""
AT_LEAST = 1.2
"""A radius of less than so many of the smallest that is looked for is that of noise."""


@dataclass(frozen=True)
class BallEvidence:
    """What a track of so many rows shows of a ball: its median radius [px], the rows of the longest stretch of smooth
    arcs along which it moves, and the share of its rows on smooth arcs."""

    rows: int
    radius_px: float
    longest: int
    smooth_share: float

    def is_ball(self, min_radius_px: float) -> bool:
        """Return False for a track that hops about, that moves nowhere, or whose radius is the smallest looked for."""
        sized = self.radius_px >= AT_LEAST * min_radius_px
        return sized and self.longest >= ARC_ROWS and self.smooth_share >= LEAST_SHARE


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

    def evidence(self) -> BallEvidence:
        """Return what the track shows of a ball."""
        if not len(self.frame):
            return BallEvidence(0, float("nan"), 0, 0.0)
        smooth = np.array([self._is_smooth(i) for i in range(len(self.frame))])
        breaks = np.flatnonzero(~smooth | (np.diff(self.frame, prepend=self.frame[0]) > BESIDE_FRAMES))
        longest = 0
        for rows in np.split(np.arange(len(smooth)), breaks):
            way_px = np.ptp(self.centre_px[rows[smooth[rows]]], axis=0) if smooth[rows].any() else np.zeros(2)
            moved_px = max(LEAST_MOVED_PX, LEAST_MOVED_RADII * float(np.median(self.radius_px)))
            if float(np.hypot(*way_px)) >= moved_px:
                longest = max(longest, int(smooth[rows].sum()))
        return BallEvidence(len(smooth), float(np.median(self.radius_px)), longest, float(smooth.mean()))

    def _is_smooth(self, i: int) -> bool:
        beside = np.abs(self.frame - self.frame[i]) <= BESIDE_FRAMES
        if int(beside.sum()) < ARC_ROWS:
            return False
        t = self.frame[beside] - self.frame[i]
        at_px = np.polynomial.polynomial.polyfit(t, self.centre_px[beside], 2)[0]
        off_px = float(np.hypot(*(at_px - self.centre_px[i])))
        return off_px <= max(NEAR_PX, NEAR_RADII * float(self.radius_px[i]))

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
