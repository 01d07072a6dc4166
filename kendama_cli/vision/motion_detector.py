"""Finding a ball that moves before a camera that stands still: what is round and differs from the background."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Sequence

import cv2
import numpy as np
from numpy.typing import NDArray

from kendama_cli.errors import StageError
from kendama_cli.vision.ball_outline import BallOutline
from kendama_cli.vision.circle_fit import Disc
from kendama_cli.vision.interface import Image, SearchHint, Sighting
from kendama_cli.vision.motion_blob import Blob, blob_of
from kendama_cli.vision.settings import MotionDetectorSettings
from kendama_cli.vision.streak import StreakGuess, streak

NOISE_SIGMAS = 6.0
"""A difference from the background counts from so many standard deviations of the image's noise on."""
MAD_SIGMA = 1.4826
"""Standard deviation of a Gaussian over its median absolute deviation."""
STRING_PART = 0.35
"""What is thinner than this part of the ball's diameter is the string: it is opened away."""
GAP_PART = 0.3
"""Between two colours of a ball lies a line of the background's own brightness, up to twice this part of its radius."""
SHAKE_SCALE = 0.5
LESS = 0.9
"""A shake is believed where it leaves less than this part of the difference."""
SHAKE_PX = 3.0
"""A camera on a table moves less; more is no shake but another view."""
SIZE_OCTAVES = 0.35
"""Balls of one film differ from their usual radius by about this many octaves: distance, blur, shadow."""
SIGMA_PART = 0.1
"""Standard deviation of a blob's centre, in radii: light and shadow are not the same on all its rim."""

GHOST = 0.4
"""Less of the rim's contrast than this in the image itself is that of the background: the ball was there, then."""
PAINTED_PART, UNROUND_PART = 0.2, 0.6
"""Standard deviation of a centre, in radii, for each part of the circle that is missing, of the blob that is not round:
measured on rendered balls of two colours, striped and wooden."""
LONG, FILLED, LEAST_ALIKE = 0.5, 0.6, 0.02
"""A blob whose way is longer than this part of its width may be a streak, where it fills so much of one and the width
is that alike to the ball's."""
EXPLAINED = 0.75
"""A streak explains this part of the difference in light, or it is none."""
MOST_STREAKS = 3


class MotionDetector:
    """Blobs that differ from a median background, the string opened away; no colour and no teaching.

    A blob's centre and radius are the circle's through its outline, where that has one; those of a long one the moving
    disc's that explains its light, where one does.

    ``learn`` must have seen the camera's images first: the median of some of them over time is the background, and what
    is round and moves in them says how large the ball is. The score is roundness times how alike its size is to that,
    times how far the blob's rim is in this image rather than in the background (where the ball hung while the
    background was taken it leaves a ghost). A streak's is the part of the light that it explains, times its size's.
    """

    def __init__(self, settings: MotionDetectorSettings) -> None:
        self._settings = settings
        self._outline = BallOutline(settings)
        self._background: Image | None = None
        self._usual_px: float | None = None

    def learn(self, images: Sequence[Image]) -> None:
        """Take the background and the ball's size from images (h, w, 3) of one camera, spread over its film."""
        chosen = np.linspace(0, len(images) - 1, min(len(images), self._settings.memory)).round().astype(int)
        stack = np.array([images[i] for i in chosen])
        self._background = np.partition(stack, len(stack) // 2, axis=0)[len(stack) // 2]
        self._small = _small(self._background)
        self._window = cv2.createHanningWindow(self._small.shape[::-1], cv2.CV_32F)
        self._usual_px = None
        moved = [
            blob
            for i in chosen
            for blob in self._blobs(*self._difference(images[i], (0, 0)), self._settings.min_radius_px)
        ]
        weighed = [
            (one.roundness * one.new, np.log2(one.radius_px)) for one in moved if one.roundness > 0.6 and one.new > 0.5
        ] or [(one.filled, np.log2(one.width_px / 2)) for one in moved if one.filled > FILLED]
        if weighed:
            weight, octave = np.array(weighed).T
            near = np.abs(octave[:, None] - octave) < SIZE_OCTAVES
            votes = near @ weight
            self._usual_px = float(2 ** np.median(octave[near[int(votes.argmax())]]))

    def candidates(
        self, pixels: Image, origin_px: tuple[int, int] = (0, 0), hint: SearchHint | None = None
    ) -> Iterator[Sighting]:
        """See Detector: the highest score first, or the nearest to ``hint``; raises StageError before ``learn``."""
        if self._background is None:
            raise StageError(
                "the detector 'motion' has seen no background: it works on films ('kendama camera track'), folders "
                "('kendama camera detect') and in stages, not on single images"
            )
        usual = self._usual_px if hint is None else hint.radius_px
        difference, shown, background = self._difference(pixels, origin_px)
        found = self._blobs(difference, shown, background, usual or self._settings.min_radius_px)
        streaks = self._streaks(shown, background, found, hint, usual)
        alike = [0.0 if one is None else one.score * _alike(one.radius_px, usual) for one in streaks]
        round_ones = [blob.roundness * blob.new * _alike(blob.radius_px, usual) for blob in found]
        scores = np.maximum(round_ones, alike) if found else np.zeros(0)
        expected = None if hint is None else Disc(np.asarray(hint.centre_px) - origin_px, hint.radius_px, hint.is_sized)
        if expected is None:
            order = np.argsort(-scores, kind="stable")
        else:
            off = [np.hypot(*(blob.centre_px - expected.centre)) for blob in found]
            ghosts = [blob.new < GHOST and one is None for blob, one in zip(found, streaks, strict=True)]
            order = np.lexsort([off, ghosts])
        for number in order[: self._settings.candidates]:
            seen, score = streaks[number], float(np.clip(scores[number], 0.0, 1.0))
            if seen is None:
                seen = Sighting(*self._outlined(shown, background, found[number], expected), score)
            yield dataclasses.replace(seen, centre_px=seen.centre_px + origin_px, score=score)

    def _streaks(
        self, shown: Image, background: Image, found: Sequence[Blob], hint: SearchHint | None, usual: float | None
    ) -> list[Sighting | None]:
        """The streak of each blob, None where it is none."""
        made: list[Sighting | None] = [None] * len(found)
        likely = [_alike(blob.width_px / 2, usual) * blob.filled for blob in found]
        for number in np.argsort([-one for one in likely], kind="stable")[:MOST_STREAKS]:
            if likely[number] >= LEAST_ALIKE:
                made[number] = _streak_of(found[number], shown, background, self._settings.gamma, hint)
        return made

    def _outlined(
        self, shown: Image, background: Image, blob: Blob, expected: Disc | None
    ) -> tuple[NDArray[np.float64], NDArray[np.float64], float]:
        """Centre, covariance and radius of the circle about a blob, where its outline has one; else the blob's own.

        What differs from the background is the whole ball, however it is painted; only where a part of it looks like
        the background the blob's centre is off, and the outline of the rest still has the ball's circle. Where the
        ball's size is known that circle has it: else a cap of one colour would have a circle of its own.
        """
        best, disc = None, Disc(blob.centre_px, blob.radius_px)
        if expected is not None and expected.is_sized and _is_about(blob, expected):
            best = self._outline.circle(shown, background, blob.least, expected)
        if best is None:
            best = self._outline.circle(shown, background, blob.least, disc)
        if best is not None:
            spread_px = PAINTED_PART * (1 - best.score) * best.radius_px
            return best.centre_px, best.covariance_px2 + np.eye(2) * spread_px**2, best.radius_px
        spread_px = (SIGMA_PART + UNROUND_PART * (1 - blob.roundness)) * blob.radius_px
        return blob.centre_px, np.eye(2) * spread_px**2, blob.radius_px

    def _difference(self, pixels: Image, origin_px: tuple[int, int]) -> tuple[Image, Image, Image]:
        """How ``pixels`` differ from the background (h, w, 3), the two themselves; no pixels where they do not meet."""
        assert self._background is not None
        height, width = pixels.shape[:2]
        left, top = origin_px
        background = self._without_shake(pixels, self._background[top : top + height, left : left + width])
        if background.shape != pixels.shape:
            return pixels[:0], pixels[:0], background[:0]
        return np.asarray(cv2.absdiff(pixels, background), dtype=np.uint8), pixels, background

    def _blobs(self, difference: Image, pixels: Image, background: Image, radius_px: float) -> list[Blob]:
        """What differs from the background, in the coordinates of ``pixels``."""
        if difference.size == 0:
            return []
        blue, green, red = cv2.split(difference)
        change = np.asarray(cv2.max(cv2.max(blue, green), red), dtype=np.uint8)
        counts = np.bincount(change.ravel(), minlength=256)
        middle = _median(counts)
        noise = MAD_SIGMA * _median(np.bincount(np.abs(np.arange(256) - middle), weights=counts, minlength=256))
        least = max(self._settings.contrast_min, middle + NOISE_SIGMAS * noise)
        mask = (change > least).astype(np.uint8)
        gap = 2 * round(GAP_PART * radius_px) + 1
        closed = cv2.morphologyEx(mask, cv2.MORPH_CLOSE, cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (gap, gap)))
        side = max(3, 2 * round(STRING_PART * radius_px) + 1)
        mask = np.asarray(
            cv2.morphologyEx(closed, cv2.MORPH_OPEN, cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (side, side)))
        )
        contours, _ = cv2.findContours(mask, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
        made = []
        for contour in contours:
            blob = blob_of(np.asarray(contour, dtype=np.int32), least, change, pixels, background)
            if blob is not None and self._settings.min_radius_px <= blob.radius_px <= self._settings.max_radius_px:
                made.append(blob)
        return made

    def _without_shake(self, pixels: Image, background: Image) -> Image:
        """The background moved as the camera shook, where the whole image says so."""
        assert self._background is not None
        if pixels.shape != self._background.shape:
            return background
        right, down = cv2.phaseCorrelate(self._small, _small(pixels), self._window)[0]
        right, down = right / SHAKE_SCALE, down / SHAKE_SCALE
        if not 0.3 < float(np.hypot(right, down)) <= SHAKE_PX:
            return background
        way = np.array([[1, 0, right], [0, 1, down]], dtype=np.float64)
        size = background.shape[1], background.shape[0]
        moved = np.asarray(cv2.warpAffine(background, way, size, borderMode=cv2.BORDER_REPLICATE), dtype=np.uint8)
        # what moved in the image pulls the correlation along: a true shake leaves less difference
        left = [float(cv2.norm(pixels, one, cv2.NORM_L1)) for one in (background, moved)]
        return moved if left[1] < LESS * left[0] else background


def _small(pixels: Image) -> NDArray[np.float32]:
    """The image's grey at SHAKE_SCALE."""
    small = cv2.resize(pixels, None, fx=SHAKE_SCALE, fy=SHAKE_SCALE, interpolation=cv2.INTER_AREA)
    return np.asarray(cv2.cvtColor(small, cv2.COLOR_BGR2GRAY), dtype=np.float32)


def _median(counts: NDArray[np.float64] | NDArray[np.intp]) -> int:
    """The median of values 0, 1, ... that occur so many times."""
    return int(np.searchsorted(np.cumsum(counts), counts.sum() / 2))


def _alike(radius_px: float, usual_px: float | None) -> float:
    """How well a radius fits the usual one, 0..1; 1 where none is known."""
    return 1.0 if usual_px is None else float(np.exp(-((np.log2(radius_px / usual_px) / SIZE_OCTAVES) ** 2) / 2))


def _streak_of(blob: Blob, shown: Image, background: Image, gamma: float, hint: SearchHint | None) -> Sighting | None:
    """The streak that a long blob is, where one explains it."""
    if float(np.hypot(*blob.way_px)) < LONG * blob.width_px or blob.filled < FILLED:
        return None
    is_sized = hint is not None and hint.is_sized
    radius = hint.radius_px if hint is not None and is_sized else blob.width_px / 2
    seen = streak(shown, background, gamma, StreakGuess(blob.centre_px, blob.way_px, radius, is_sized))
    return None if seen is None or seen.score < EXPLAINED else seen


def _is_about(blob: Blob, expected: Disc) -> bool:
    """Whether a blob may be a part of the ball that is expected."""
    return float(np.hypot(*(blob.centre_px - expected.centre))) < expected.radius
