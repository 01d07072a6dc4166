"""How large the ball is in a camera's images, from what moves in them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from kendama_cli.vision.image_change import ImageChange
from kendama_cli.vision.motion_blob import Blob, blobs_of, parts_of

SIZE_OCTAVES = 0.35
"""Balls of one film differ from their usual radius by about this many octaves: distance, blur, shadow."""
LOOKED_AT_PX = 6.0
"""Larger balls are looked for in images made so much smaller."""
LEAST_ROUND, LEAST_NEW = 0.6, 0.5
FILLED = 0.6
"""A streak fills so much of the way of a disc."""


def usual_radius_px(changes: Sequence[ImageChange], min_px: float, max_px: float) -> float | None:
    """The radius [px] of what is round in most of a camera's images; None where nothing is.

    Radii from ``min_px`` to ``max_px`` are tried in steps of SIZE_OCTAVES: what is thinner than a ball of that radius
    is opened away, and what is left and has that radius votes for it with its roundness. The votes of one image are
    shared among what it has of a size: a ball is one, specks and pieces of string are many. Where nothing is round
    what fills a streak's shape votes for its width.
    """
    steps = int(np.ceil(np.log2(max_px / min_px) / SIZE_OCTAVES)) + 1
    sizes = min_px * 2 ** (SIZE_OCTAVES * np.arange(steps))
    found = [(number, size, blob) for size in sizes for number, blob in _of_size(changes, float(size))]
    for weighed in (_round, _streaks):
        votes = [
            (number, radius, weight)
            for number, size, blob in found
            for radius, weight in [weighed(blob)]
            if weight > 0 and abs(np.log2(radius / size)) <= SIZE_OCTAVES / 2 and min_px <= radius <= max_px
        ]
        if votes:
            return _most_votes(*np.array(votes).T)
    return None


def _of_size(changes: Sequence[ImageChange], size_px: float) -> list[tuple[int, Blob]]:
    """The number of the image and the blob, for all blobs when a ball of ``size_px`` is looked for."""
    factor = min(1.0, LOOKED_AT_PX / size_px)
    found = []
    for number, change in enumerate(changes):
        smaller, radius_px = change.scaled(factor), size_px * factor
        for blob in blobs_of(smaller, radius_px):
            parts = parts_of(smaller, blob, radius_px) if blob.is_mixed(blob.width_px / 2) else []
            found += [(number, one.scaled(1 / factor)) for one in (blob, *parts)]
    return found


def _round(blob: Blob) -> tuple[float, float]:
    """The radius that a round blob votes for, and with what weight."""
    is_round = blob.roundness > LEAST_ROUND and blob.new > LEAST_NEW
    return blob.radius_px, blob.roundness * blob.new if is_round else 0.0


def _streaks(blob: Blob) -> tuple[float, float]:
    """The radius that a streak votes for, and with what weight."""
    return blob.width_px / 2, blob.filled if blob.filled > FILLED else 0.0


def _most_votes(number: np.ndarray, radius_px: np.ndarray, weight: np.ndarray) -> float:
    octave = np.log2(radius_px)
    near = np.abs(octave[:, None] - octave) < SIZE_OCTAVES
    of_image = number[:, None] == number
    shared = weight**2 / ((near & of_image) @ weight)
    best = int((near @ shared).argmax())
    return float(2 ** np.median(octave[near[best]]))
