"""The ball in the film of one camera: candidates in every frame, then the motion that explains most of them."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from itertools import islice

import numpy as np

from kendama_cli.plugins.films.ball_box import TrainedImage
from kendama_cli.plugins.films.ball_region import placed
from kendama_cli.schema.arrays import Array
from kendama_cli.vision.cameras.camera_model import CameraModel
from kendama_cli.vision.detection.interface import Detector, Image, Sighting

HALF_FRAMES = 5
"""A candidate is judged with those of so many frames to either side."""
THROUGH_FRAMES = 3
"""... on motions through candidates of frames at most so far away."""
NEAR_RADII = 0.7
"""A candidate belongs to a motion when it lies within so many ball radii of it."""
MOST_RADII_A_FRAME = 5.0
"""A ball is at most so many radii from its place one frame before: 6 m/s at 30 frames a second, 20 mm of radius,
come to 10; what is faster is followed through its neighbours."""
LEAST_SUPPORT = 1.2
"""Score of all candidates on a motion; one alone, sure as it may be, is not enough."""
SOLITARY = 0.9
STILL_PART, STILL_FRAMES = 0.5, 200
"""A detection at one place, to a ball's radius, in this part of the images (so many of the film) stands still."""
MOVING_PART = 0.1
"""A ball that moves in this part of the film tells what else there is."""
CANDIDATES = 6
Frames = Callable[[], Iterable[tuple[float, Image]]]
"""Returns the times [s] and images of a film, from its first frame on."""


@dataclass(frozen=True)
class TrackedBall:
    """The ball in one image: the sighting that was chosen, and the support that it has (0 to 2 HALF_FRAMES + 1)."""

    frame: int
    sighting: Sighting
    support: float


def track(candidates: Sequence[Sequence[Sighting]], threshold: float) -> list[TrackedBall | None]:
    """Return the ball in every frame, None if not seen, from the ``candidates`` of each frame of one camera.

    Track before detect: about each frame, parabolas u(t), v(t) (constant acceleration) through candidates of three
    frames are tried; a motion's support is the sum of the scores of the candidates within NEAR_RADII of it, one a
    frame. The candidate with the most support is the ball where the support is that of a motion, or where it is sure
    by itself and alone in its neighbourhood in time.

    What stands still has the support of a motion too. A place that shows something in half of those images in which a
    ball that moves is seen elsewhere is scenery, and no candidate; a ball that rests first leaves its place.
    """
    moving = _follow(_without(candidates, range(len(candidates))), threshold)
    seen = [frame for frame, ball in enumerate(moving) if ball is not None]
    if len(seen) < max(MOVING_PART * len(candidates), HALF_FRAMES):
        return _follow(candidates, threshold)
    return _follow(_without(candidates, seen), threshold)


def _without(candidates: Sequence[Sequence[Sighting]], frames: Sequence[int]) -> list[list[Sighting]]:
    """Remove ``candidates`` at positions where something is in STILL_PART of ``frames``."""
    looked = frames[:: max(1, len(frames) // STILL_FRAMES)]
    number = np.array([k for k, frame in enumerate(looked) for _ in candidates[frame]], dtype=np.intp)
    places = np.array([one.centre_px for frame in looked for one in candidates[frame]]).reshape(-1, 2)

    def stands(one: Sighting) -> bool:
        there = np.hypot(*(places - one.centre_px).T) <= one.radius_px
        return len(np.unique(number[there])) >= max(STILL_PART * len(looked), 2)

    return [[one for one in frame if not stands(one)] for frame in candidates]


def _follow(candidates: Sequence[Sequence[Sighting]], threshold: float) -> list[TrackedBall | None]:
    """Return the candidate of each frame with the most support, None if none has enough; see track."""
    chosen: list[TrackedBall | None] = []
    for frame in range(len(candidates)):
        first, last = max(0, frame - HALF_FRAMES), min(len(candidates), frame + HALF_FRAMES + 1)
        window = [
            (
                k - frame,
                np.array([one.centre_px for one in candidates[k]]),
                np.array([one.score for one in candidates[k]]),
            )
            for k in range(first, last)
            if k != frame and candidates[k]
        ]
        best: TrackedBall | None = None
        for one in candidates[frame]:
            support = one.score + _support(one, window)
            sure = support >= LEAST_SUPPORT or (one.score >= max(threshold, SOLITARY) and not window)
            if sure and (best is None or support > best.support):
                best = TrackedBall(frame, one, support)
        chosen.append(best)
    return chosen


def _support(one: Sighting, window: Sequence[tuple[int, Array, Array]]) -> float:
    """Return the best sum of scores over motions through ``one`` and candidates of one frame before or after each."""
    near, reach = NEAR_RADII * one.radius_px, MOST_RADII_A_FRAME * 2 * one.radius_px
    close = [(k, rows - one.centre_px) for k, rows, _ in window if abs(k) <= THROUGH_FRAMES]
    if len(close) < 2:
        return 0.0
    frames = np.concatenate([np.full(len(rows), float(k)) for k, rows in close])
    places = np.concatenate([rows for _, rows in close])
    within = np.hypot(*places.T) <= reach * np.abs(frames)
    frames, places = frames[within], places[within]
    first, second = np.nonzero(frames[:, None] < frames)
    if len(first) == 0:
        return 0.0
    # u(t) = c + p t + q t^2 through 0, k and m
    k, m, a, b = frames[first][:, None], frames[second][:, None], places[first], places[second]
    p = (a * m / k - b * k / m) / (m - k)
    q = (b / m - a / k) / (m - k)
    total = np.zeros(len(first))
    for t, rows, scores in window:
        off = (rows - one.centre_px) - (p * t + q * t * t)[:, None]
        on = np.hypot(off[..., 0], off[..., 1]) <= near
        total += np.where(on, scores, 0.0).max(axis=1)
    return float(total.max())


@dataclass(frozen=True)
class FilmTrack:
    """The ball's sightings in one film: frame number, time [s], centre (n, 2) [px], its covariance (n, 2, 2) [px^2],
    radius [px] and score of each frame where it was seen."""

    name: str
    frame: Array
    t_s: Array
    centre_px: Array
    covariance_px2: Array
    radius_px: Array
    score: Array

    def exposed(self, camera: CameraModel) -> FilmTrack:
        """With the frames' times turned into those at which ``camera`` exposed the ball's rows."""
        return replace(self, t_s=camera.exposed_s(self.t_s, self.centre_px))


def film_track(
    name: str, frames: Frames, detector: Detector, threshold: float, taught: Sequence[TrainedImage] = ()
) -> FilmTrack:
    """Track the ball through ``frames``.

    If boxes in the images ``taught`` the detector, the film is read again, and sightings go to the disc that the ball's
    colours fill.
    """
    times: list[float] = []
    candidates: list[Sequence[Sighting]] = []
    for t_s, pixels in frames():
        times.append(t_s)
        candidates.append(list(islice(detector.candidates(pixels), CANDIDATES)))
    seen = {one.frame: one.sighting for one in track(candidates, threshold) if one is not None}
    if taught:
        seen = placed(seen, (pixels for _, pixels in frames()), taught)
    return FilmTrack(
        name,
        np.array(list(seen), dtype=np.float64),
        np.array([times[frame] for frame in seen]),
        np.array([one.centre_px for one in seen.values()]).reshape(-1, 2),
        np.array([one.covariance_px2 for one in seen.values()]).reshape(-1, 2, 2),
        np.array([one.radius_px for one in seen.values()]),
        np.array([one.score for one in seen.values()]),
    )
