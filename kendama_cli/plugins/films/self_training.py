"""A trained ball learned further from the film in which it is sought, whose background no box has shown."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterator, Sequence
from itertools import islice

import numpy as np

from kendama_cli.plugins.films.ball_box import LEAST_CONTRAST, BallBox, TrainedImage
from kendama_cli.plugins.films.ball_film import CANDIDATES
from kendama_cli.plugins.films.ball_region import BallRegion, learn_region
from kendama_cli.plugins.films.box_similarity import odd_images
from kendama_cli.plugins.films.image_track import TrackedBall, track
from kendama_cli.plugins.films.training import TrainedBall, teach
from kendama_cli.vision.detection.interface import Detector, Image, SearchHint, Sighting


class RegionDetector:
    """The sightings of ``detector``, each moved to the disc that the ball's colours fill, with its radius."""

    def __init__(self, detector: Detector, region: BallRegion) -> None:
        self._detector, self._region = detector, region

    def candidates(
        self, pixels: Image, origin_px: tuple[int, int] = (0, 0), hint: SearchHint | None = None
    ) -> Iterator[Sighting]:
        """See Detector."""
        corner = np.array(origin_px, dtype=np.float64)
        for one in self._detector.candidates(pixels, origin_px, hint):
            placed = self._region.placed(pixels, dataclasses.replace(one, centre_px=one.centre_px - corner))
            yield dataclasses.replace(placed, centre_px=placed.centre_px + corner)


FRAMES = 60
"""So many frames in a row are looked at."""
ROUNDS = 3
MOST, APART_FRAMES, FEWEST = 8, 3, 3
"""Frames that teach in one round, and how far apart they are; with fewer, the film's background teaches too."""
SUPPORTS = (3.0, 1.5)
"""Support of a sighting that teaches; the second where too few have the first."""
NEAR_FRAMES, FEWEST_NEAR, MOVED_RADII = 4, 4, 2.0
"""A ball moves where it is seen in so many of the frames about it and comes so many radii away from its place."""
BACKGROUND_FRAMES = 31


def trained_on_film(
    images: Sequence[TrainedImage],
    ball: TrainedBall,
    frames: Sequence[Image],
    detector: Callable[[TrainedBall], Detector],
    *,
    threshold: float,
    seed: int = 0,
) -> Detector:
    """Return a ``detector`` of the ``ball``, trained further by ``frames`` in a row of a film if they help.

    Detections are placed by the ball's region in that film.
    """
    learned = ball
    for number in range(ROUNDS + 1):
        seeing = detector(learned)
        candidates = [list(islice(seeing.candidates(pixels), CANDIDATES)) for pixels in frames]
        moving = _moving(track(candidates, threshold))
        region = learn_region(images, [(frames[one.frame], one.sighting) for one in moving])
        if number == ROUNDS:
            break
        shown = _shown(moving, frames, region)
        try:
            learned = _trained(images, shown, frames, seed)
        except ValueError:  # what was found is no ball like the others
            break
    found = detector(learned if moving else ball)
    return found if region is None else RegionDetector(found, region)


def _trained(
    images: Sequence[TrainedImage], shown: Sequence[TrainedImage], frames: Sequence[Image], seed: int
) -> TrainedBall:
    """Train on ``images`` together with those of ``shown`` that training does not refuse."""
    kept = [one for one in shown if all(box.contrast(one.pixels) >= LEAST_CONTRAST for box in one.boxes)]

    def teaching() -> list[TrainedImage]:
        return [*images, *kept, *([_background(frames)] if len(kept) < FEWEST else [])]

    try:
        return teach(teaching(), seed)
    except ValueError:
        odd = odd_images([*images, *kept], seed)
        kept = [one for number, one in enumerate(kept, len(images)) if number not in odd]
        return teach(teaching(), seed)


def _moving(tracked: Sequence[TrackedBall | None]) -> list[TrackedBall]:
    """Return the detections of a ball that moves."""
    found = []
    for one in tracked:
        if one is None:
            continue
        near = [other for other in tracked[max(one.frame - NEAR_FRAMES, 0) : one.frame + NEAR_FRAMES + 1] if other]
        away = max(float(np.hypot(*(other.sighting.centre_px - one.sighting.centre_px))) for other in near)
        if len(near) >= FEWEST_NEAR and away > MOVED_RADII * one.sighting.radius_px:
            found.append(one)
    return found


def _shown(moving: Sequence[TrackedBall], frames: Sequence[Image], region: BallRegion | None) -> list[TrainedImage]:
    """Return the frames with the best supported detections, with boxes about them."""
    chosen: list[TrackedBall] = []
    for least in SUPPORTS:
        chosen = []
        for one in sorted(moving, key=lambda one: -one.support):
            apart = all(abs(one.frame - other.frame) >= APART_FRAMES for other in chosen)
            if one.support >= least and apart and len(chosen) < MOST:
                chosen.append(one)
        if len(chosen) >= FEWEST:
            break
    placed = [one.sighting if region is None else region.placed(frames[one.frame], one.sighting) for one in chosen]
    return [TrainedImage(frames[one.frame], (_box(sighting),)) for one, sighting in zip(chosen, placed, strict=True)]


def _box(sighting: Sighting) -> BallBox:
    u, v = sighting.centre_px.tolist()
    return BallBox(u, v, 2 * sighting.radius_px, 2 * sighting.radius_px)


def _background(frames: Sequence[Image]) -> TrainedImage:
    """Return the median of some of the frames: what moves is not in it."""
    some = frames[:: max(len(frames) // BACKGROUND_FRAMES, 1)]
    return TrainedImage(np.median(np.array(some), axis=0).astype(np.uint8), ())
