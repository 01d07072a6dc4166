"""Finding a ball that moves before a camera that stands still: what is round and differs from the background."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from kendama_cli.errors import StageError
from kendama_cli.vision.background import Background
from kendama_cli.vision.ball_outline import BallOutline
from kendama_cli.vision.circle_fit import Disc
from kendama_cli.vision.image_change import ImageChange, change_of
from kendama_cli.vision.interface import Image, SearchHint, Sighting
from kendama_cli.vision.motion_blob import Blob, blobs_of, parts_of
from kendama_cli.vision.settings import MotionDetectorSettings
from kendama_cli.vision.streak import StreakGuess, streak
from kendama_cli.vision.usual_size import size_likeness, usual_radius_px

SIZED_FROM = 11
"""So many images, spread over the film, tell how large the ball is."""
SIGMA_PART = 0.1
"""Standard deviation of a blob's centre, in radii: light and shadow are not the same on all its rim."""

GHOST = 0.4
"""Less of the rim's contrast than this in the image itself is that of the background: the ball was there, then."""
PAINTED_PART, UNROUND_PART = 0.2, 0.6
"""Standard deviation of a centre, in radii, for each part of the circle that is missing, of the blob that is not round:
measured on rendered balls of two colours, striped and wooden."""
LEAST_ALIKE = 0.02
"""A blob may be a streak where its width is that alike to the ball's."""
EXPLAINED = 0.75
"""A streak explains this part of the difference in light, or it is none."""
MOST_STREAKS = 3
LEAST_SCORE, MOST_UNLIKE = 0.003, 2.3
"""What scores less is no candidate, nor a part that is so many times larger or smaller than the ball: another thing."""


class MotionDetector:
    """Blobs that differ from a median background, the string opened away; no colour and no teaching.

    A blob's centre and radius are the circle's through its outline, where that has one; those of a long one the moving
    disc's that explains its light, where one does.

    ``learn`` must have seen the camera's images first: the median of some of them over time is the background, and what
    is round and moves in them says how large the ball is. The score is roundness times how alike its size is to that,
    times how far the blob's rim is in this image rather than in the background (where the ball hung while the
    background was taken it leaves a ghost), less where all of it may be a shadow. A streak's is the part of the light
    that it explains, times its size's, less where it may be a shadow.
    """

    def __init__(self, settings: MotionDetectorSettings) -> None:
        self._settings = settings
        self._outline = BallOutline(settings)
        self._background: Background | None = None
        self._unsized: list[Image] = []
        self._usual_px: float | None = None

    @property
    def min_radius_px(self) -> float:
        """The smallest ball that is looked for [px]."""
        return self._settings.min_radius_px

    def learn(self, images: Sequence[Image]) -> None:
        """Take the background and the ball's size from images (h, w, 3) of one camera, spread over its film."""
        chosen = [images[i] for i in _spread(len(images), self._settings.memory)]
        self._background = Background(chosen)
        self._unsized = [chosen[i] for i in _spread(len(chosen), SIZED_FROM)]

    def candidates(
        self, pixels: Image, origin_px: tuple[int, int] = (0, 0), hint: SearchHint | None = None
    ) -> Iterator[Sighting]:
        """See Detector: the highest score first, or the nearest to ``hint``; raises StageError before ``learn``."""
        if self._background is None:
            raise StageError(
                "the detector 'motion' has seen no background: it works on films ('kendama camera track'), folders "
                "('kendama camera detect') and in stages, not on single images"
            )
        usual = self._usual() if hint is None else hint.radius_px
        change = self._change(pixels, origin_px)
        if change is None:
            return
        whole, parts = self._parted(change, usual)
        found = whole + parts
        round_ones = [blob.likeness * _alike(blob.radius_px, usual) for blob in found]
        streaks = self._streaks(change, whole, hint, usual) + [None] * len(parts)
        alike = [
            0.0 if one is None else one.score * blob.lit * _alike(one.radius_px, usual)
            for blob, one in zip(found, streaks, strict=True)
        ]
        scores = np.maximum(round_ones, alike) if found else np.zeros(0)
        order = _in_places(found, scores)
        expected = None if hint is None else Disc(np.asarray(hint.centre_px) - origin_px, hint.radius_px, hint.is_sized)
        painted_px = None if hint is None else hint.painted_px
        if expected is not None:
            order = sorted(order, key=lambda i: _unlikely(found[i], float(scores[i]), streaks[i], expected))
        for number in order[: self._settings.candidates]:
            seen, score = streaks[number], float(np.clip(scores[number], 0.0, 1.0))
            if seen is None:
                seen = _outlined(self._outline, change, found[number], expected, painted_px)
            yield dataclasses.replace(seen, centre_px=seen.centre_px + origin_px, score=score)

    def _usual(self) -> float | None:
        """The ball's radius [px], judged when it is first asked for: who knows where the ball is needs it not."""
        if self._unsized:
            changes = [self._change(one, (0, 0)) for one in self._unsized]
            smallest, largest = self._settings.min_radius_px, self._settings.max_radius_px
            self._usual_px = usual_radius_px([one for one in changes if one is not None], smallest, largest)
            self._unsized = []
        return self._usual_px

    def _change(self, pixels: Image, origin_px: tuple[int, int]) -> ImageChange | None:
        """How ``pixels`` differ from the background, None where they lie outside of it."""
        assert self._background is not None
        behind = self._background.behind(pixels, origin_px)
        return None if behind is None else change_of(pixels, behind, self._settings.contrast_min)

    def _parted(self, change: ImageChange, usual: float | None) -> tuple[list[Blob], list[Blob]]:
        """The blobs of a change that may be a ball, and the parts of all that hold one."""
        smallest, largest = self._settings.min_radius_px, self._settings.max_radius_px
        radius_px = usual or smallest
        sizes_px = (smallest, largest) if usual is None else (usual / MOST_UNLIKE, usual * MOST_UNLIKE)
        blobs = blobs_of(change, radius_px)
        parts = [
            part for blob in blobs if blob.is_mixed(radius_px) for part in parts_of(change, blob, radius_px, sizes_px)
        ]
        whole, sized = ([one for one in some if smallest <= one.radius_px <= largest] for some in (blobs, parts))
        return whole, sized

    def _streaks(
        self, change: ImageChange, found: Sequence[Blob], hint: SearchHint | None, usual: float | None
    ) -> list[Sighting | None]:
        """The streak of each blob, None where it is none."""
        made: list[Sighting | None] = [None] * len(found)
        likely = [
            _alike(blob.width_px / 2, usual) * blob.filled if blob.may_be_streak(usual or blob.width_px / 2) else 0.0
            for blob in found
        ]
        for number in np.argsort([-one for one in likely], kind="stable")[:MOST_STREAKS]:
            if likely[number] >= LEAST_ALIKE:
                made[number] = _streak_of(found[number], change, self._settings.gamma, hint)
        return made


def _spread(number: int, most: int) -> list[int]:
    """At most ``most`` of the numbers below ``number``, evenly spread."""
    return [round(one) for one in np.linspace(0, number - 1, min(number, most))]


def _in_places(found: Sequence[Blob], scores: NDArray[np.float64]) -> list[int]:
    """The best of what lies within a radius of each other, the highest score first."""
    kept: list[int] = []
    for i in np.argsort(-scores, kind="stable"):
        centre, radius = found[i].centre_px, found[i].radius_px
        if scores[i] >= LEAST_SCORE and all(
            float(np.hypot(*(found[k].centre_px - centre))) > max(found[k].radius_px, radius) for k in kept
        ):
            kept.append(int(i))
    return kept


def _unlikely(blob: Blob, score: float, seen: Sighting | None, expected: Disc) -> tuple[bool, float]:
    """How unlikely it is that a blob is the ball that is expected: a ghost least likely; then by d^2/2 - 2 ln score, d
    in radii: the place is known to a radius, and clutter beside the ball scores less than it."""
    is_ghost = blob.new < GHOST and seen is None
    off = float(np.hypot(*(blob.centre_px - expected.centre))) / expected.radius
    return is_ghost, off**2 / 2 - 2 * float(np.log(score))


def _alike(radius_px: float, usual_px: float | None) -> float:
    """How well a radius fits the usual one, 0..1; 1 where none is known."""
    return 1.0 if usual_px is None else size_likeness(radius_px, usual_px)


def _outlined(
    outline: BallOutline, change: ImageChange, blob: Blob, expected: Disc | None, painted_px: float | None
) -> Sighting:
    """The circle about a blob, where its outline has one; else the blob's own.

    What differs from the background is the whole ball, however it is painted; only where a part of it looks like
    the background the blob's centre is off, and the outline of the rest still has the ball's circle. Where the
    ball's size is known that circle has it: else a cap of one colour would have a circle of its own. A ball of
    several colours has the one of ``painted_px``, where that is known.
    """
    best, about = None, expected is not None and _is_about(blob, expected)
    if painted_px is not None and about:
        best = outline.painted_circle(change.pixels, change.background, blob.least, Disc(blob.centre_px, painted_px))
        if best is not None:
            return best
    if expected is not None and expected.is_sized and about:
        best = outline.circle(change.pixels, change.background, blob.least, expected)
    if best is None:
        best = outline.circle(change.pixels, change.background, blob.least, Disc(blob.centre_px, blob.radius_px))
    if best is not None:
        spread_px = PAINTED_PART * (1 - best.score) * best.radius_px
        return dataclasses.replace(best, covariance_px2=best.covariance_px2 + np.eye(2) * spread_px**2)
    spread_px = (SIGMA_PART + UNROUND_PART * (1 - blob.roundness)) * blob.radius_px
    return Sighting(blob.centre_px, np.eye(2) * spread_px**2, blob.radius_px, 0.0)


def _streak_of(blob: Blob, change: ImageChange, gamma: float, hint: SearchHint | None) -> Sighting | None:
    """The streak that a blob of such a shape is, where one explains it."""
    is_sized = hint is not None and hint.is_sized
    radius = hint.radius_px if hint is not None and is_sized else blob.width_px / 2
    seen = streak(change.pixels, change.background, gamma, StreakGuess(blob.centre_px, blob.way_px, radius, is_sized))
    return None if seen is None or seen.score < EXPLAINED else seen


def _is_about(blob: Blob, expected: Disc) -> bool:
    """Whether a blob may be a part of the ball that is expected."""
    return float(np.hypot(*(blob.centre_px - expected.centre))) < expected.radius
