"""A taught ball learned further from the film in which it is sought, whose background no box has shown."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import islice

import numpy as np

from kendama_cli.vision.ball_box import BallBox, TaughtImage
from kendama_cli.vision.ball_film import CANDIDATES
from kendama_cli.vision.image_track import TrackedBall, track
from kendama_cli.vision.interface import Detector, Image
from kendama_cli.vision.teaching import TaughtBall, teach

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
    images: Sequence[TaughtImage],
    ball: TaughtBall,
    frames: Sequence[Image],
    detector: Callable[[TaughtBall], Detector],
    *,
    threshold: float,
    seed: int = 0,
) -> TaughtBall:
    """``ball``, which ``images`` taught, or what it becomes when ``frames`` in a row of a film teach it too.

    Self-training in ROUNDS: the best supported sightings of a ball that moves are taught as boxes, and so is all else
    in their frames as not the ball. Where hardly anything moves, what stands still in the film was taken for the ball:
    the frames' median is taught as an image without one. Where nothing moves to the end ``ball`` is returned as it was,
    for it may rest. Rounds are not compared by their support: what is wrongly taken for the ball may have much.
    """
    learned = ball
    for number in range(ROUNDS + 1):
        candidates = [list(islice(detector(learned).candidates(pixels), CANDIDATES)) for pixels in frames]
        moving = _moving(track(candidates, threshold))
        if number == ROUNDS:
            break
        shown = _shown(moving, frames)
        if len(shown) < FEWEST:
            shown.append(_background(frames))
        try:
            learned = teach([*images, *shown], seed)
        except ValueError:  # what was found is no ball like the others
            return learned if moving else ball
    return learned if moving else ball


def _moving(tracked: Sequence[TrackedBall | None]) -> list[TrackedBall]:
    """The sightings of a ball that moves."""
    found = []
    for one in tracked:
        if one is None:
            continue
        near = [other for other in tracked[max(one.frame - NEAR_FRAMES, 0) : one.frame + NEAR_FRAMES + 1] if other]
        away = max(float(np.hypot(*(other.sighting.centre_px - one.sighting.centre_px))) for other in near)
        if len(near) >= FEWEST_NEAR and away > MOVED_RADII * one.sighting.radius_px:
            found.append(one)
    return found


def _shown(moving: Sequence[TrackedBall], frames: Sequence[Image]) -> list[TaughtImage]:
    """The frames with the best supported sightings, with boxes about them."""
    chosen: list[TrackedBall] = []
    for least in SUPPORTS:
        chosen = []
        for one in sorted(moving, key=lambda one: -one.support):
            apart = all(abs(one.frame - other.frame) >= APART_FRAMES for other in chosen)
            if one.support >= least and apart and len(chosen) < MOST:
                chosen.append(one)
        if len(chosen) >= FEWEST:
            break
    return [TaughtImage(frames[one.frame], (_box(one),)) for one in chosen]


def _box(one: TrackedBall) -> BallBox:
    u, v = one.sighting.centre_px.tolist()
    return BallBox(u, v, 2 * one.sighting.radius_px, 2 * one.sighting.radius_px)


def _background(frames: Sequence[Image]) -> TaughtImage:
    """The median of some of the frames: what moves is not in it."""
    some = frames[:: max(len(frames) // BACKGROUND_FRAMES, 1)]
    return TaughtImage(np.median(np.array(some), axis=0).astype(np.uint8), ())
