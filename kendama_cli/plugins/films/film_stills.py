"""Stills of a film to choose from, and those that differ most."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass

import cv2
import numpy as np

from kendama_cli.errors import InputError
from kendama_cli.plugins.shared.videos.video import VideoFile
from kendama_cli.schema.arrays import Array
from kendama_cli.schema.units import count_of
from kendama_cli.vision.detection.interface import Image

MOST = 240
"""Stills of one film that are kept."""
OFFERED = 10
SMALL_PX = (48, 36)
QUALITY = 92


@dataclass(frozen=True)
class Stills:
    """JPEG files by the number of their frame, and which of them are offered first."""

    width_px: int
    height_px: int
    frames: int
    jpeg: dict[int, bytes]
    offered: tuple[int, ...]

    def pixels(self, frame: int) -> Image:
        """Return the still as it is shown."""
        return np.asarray(cv2.imdecode(np.frombuffer(self.jpeg[frame], dtype=np.uint8), cv2.IMREAD_COLOR), np.uint8)


def film_stills(film: VideoFile, also: Collection[int] = ()) -> Stills:
    """Even stills of the whole film, and those of the frames ``also``; raises InputError for a film of under 3 frames.

    Of each tenth of the film that one is offered that differs most from those before.
    """
    frames = film.count()
    if frames < 3:
        raise InputError(
            str(film.path), f"it has {count_of(frames, 'frame')}", remedy="give a film in which the ball moves"
        )
    every = -(-frames // MOST)
    jpeg: dict[int, bytes] = {}
    small: list[Array] = []
    even: list[int] = []
    for number, (_, pixels) in enumerate(film.frames()):
        if number % every and number not in also:
            continue
        jpeg[number] = cv2.imencode(".jpg", pixels, [cv2.IMWRITE_JPEG_QUALITY, QUALITY])[1].tobytes()
        if number % every == 0:
            even.append(number)
            little = cv2.resize(pixels, SMALL_PX, interpolation=cv2.INTER_AREA)
            small.append(np.asarray(little, dtype=np.float64).ravel())
    offered = sorted({*(even[i] for i in different(np.array(small), OFFERED)), *(set(also) & set(jpeg))})
    return Stills(film.width_px, film.height_px, frames, jpeg, tuple(offered))


def different(values: Array, count: int) -> list[int]:
    """Choose from each of ``count`` equal parts of ``values`` (n, d) the row farthest from those chosen before.

    The first part's is the row farthest from the median.
    """
    chosen: list[int] = []
    for part in np.array_split(np.arange(len(values)), min(count, len(values))):
        before = values[chosen] if chosen else np.median(values, axis=0, keepdims=True)
        away = np.min(np.linalg.norm(values[part][:, None] - before[None], axis=2), axis=1)
        chosen.append(int(part[np.argmax(away)]))
    return chosen
