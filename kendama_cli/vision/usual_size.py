"""How large the ball is in a camera's images, from what moves in them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from kendama_cli.vision.image_change import ImageChange
from kendama_cli.vision.motion_blob import Blob, blobs_of, parts_of

SIZE_OCTAVES = 0.35
"""Balls of one film differ from their usual radius by about this many octaves: distance, blur, shadow."""
STEP = 2**0.25
"""What is larger or smaller than a size by more votes for the next; what lies between two may vote when either is
tried."""
LOOKED_AT_PX = 6.0
"""Larger balls are looked for in images made so much smaller."""
LEAST_ROUND, LEAST_NEW = 0.7, 0.5
SHADE_PART = 0.15
"""What may be all shadow votes for its size with so much less: of two things as round the ball is the other one."""
CLEAR, NOISY_PART = 2.0, 0.1
"""What differs by less than so many least differences votes with this part: specks that a film's codec leaves barely
pass the least one, but they are round and in most images."""


def usual_radius_px(changes: Sequence[ImageChange], min_px: float, max_px: float) -> float | None:
    """The radius [px] of what is round in most of a camera's images; None where nothing is.

    Radii from ``min_px`` to ``max_px`` are tried in steps of SIZE_OCTAVES: what is thinner than a ball of that radius
    is opened away, and what is left and has that radius votes for it with its roundness. Of an image the roundest
    counts: a ball is one, specks and pieces of string are many. Where nothing is round what fills a streak's shape
    votes for its width.
    """
    steps = int(np.ceil(np.log2(max_px / min_px) / SIZE_OCTAVES)) + 1
    sizes = min_px * 2 ** (SIZE_OCTAVES * np.arange(steps))
    found = [(number, size, blob) for size in sizes for number, blob in _of_size(changes, float(size))]
    for weighed in (_round, _streaks):
        votes = [
            _Vote(number, radius, weight)
            for number, size, blob in found
            for radius, weight in [weighed(blob)]
            if weight > 0 and 1 / STEP <= radius / size <= STEP and min_px <= radius <= max_px
        ]
        if votes:
            return _most_votes(votes)
    return None


def size_likeness(radius_px: float, usual_px: float) -> float:
    """How well a radius fits the usual one, 0..1: exp(-x^2 / 2) of their distance x in SIZE_OCTAVES."""
    return float(np.exp(-((np.log2(radius_px / usual_px) / SIZE_OCTAVES) ** 2) / 2))


@dataclass(frozen=True)
class _Vote:
    image: int
    radius_px: float
    weight: float


def _of_size(changes: Sequence[ImageChange], size_px: float) -> list[tuple[int, Blob]]:
    """The number of the image and the blob, for what may be or hold a ball of ``size_px``."""
    factor = min(1.0, LOOKED_AT_PX / size_px)
    found = []
    for number, change in enumerate(changes):
        smaller, radius_px = change.scaled(factor), size_px * factor
        least_px, most_px = radius_px / STEP, radius_px * STEP
        for blob in blobs_of(smaller, radius_px, least_px):
            mixed = blob.is_mixed(blob.width_px / 2)
            parts = parts_of(smaller, blob, radius_px, (least_px, most_px)) if mixed else []
            found += [(number, one.scaled(1 / factor)) for one in (blob, *parts)]
    return found


def _round(blob: Blob) -> tuple[float, float]:
    """The radius that a round blob votes for, and with what weight."""
    is_round = blob.roundness > LEAST_ROUND and blob.new > LEAST_NEW
    weight = blob.roundness * blob.new * (1 - SHADE_PART * blob.shade)
    return blob.radius_px, weight * _clear(blob) if is_round else 0.0


def _streaks(blob: Blob) -> tuple[float, float]:
    """The radius that a streak votes for, and with what weight."""
    return blob.width_px / 2, blob.filled * _clear(blob) if blob.may_be_streak(blob.width_px / 2) else 0.0


def _clear(blob: Blob) -> float:
    """Return how far a blob is more than noise, NOISY_PART to 1."""
    return 1.0 if blob.contrast >= CLEAR else NOISY_PART


def _most_votes(votes: Sequence[_Vote]) -> float:
    """The radius for which most is; of an image the heaviest vote counts."""
    octave = np.log2([vote.radius_px for vote in votes])
    image, weight = np.array([vote.image for vote in votes]), np.array([vote.weight for vote in votes])
    best, most = octave, -1.0
    for middle in octave:
        near = np.abs(octave - middle) < SIZE_OCTAVES
        heaviest = np.zeros(image.max() + 1)
        np.maximum.at(heaviest, image[near], weight[near])
        if heaviest.sum() > most:
            best, most = octave[near], float(heaviest.sum())
    return float(2 ** np.median(best))
