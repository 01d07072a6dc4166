"""Stills of a film to choose from, and the boxes that somebody draws in them, checked while they are drawn."""

from __future__ import annotations

import math
import threading
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from kendama_cli.errors import InputError
from kendama_cli.plugins.films.ball_box import FEWEST_BOXES, LEAST_CONTRAST, LEAST_SIDE_PX, BallBox, TrainedImage
from kendama_cli.plugins.films.boxes import read_boxes, write_labelled
from kendama_cli.plugins.shared.videos.video import VideoFile
from kendama_cli.schema.arrays import Array
from kendama_cli.schema.units import count_of
from kendama_cli.vision.detection.interface import Image

MOST = 240
"""Stills of one film that are kept."""
OFFERED = 10
SMALL_PX = (48, 36)
QUALITY = 92
Drawn = tuple[BallBox, ...]


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


class DrawnBoxes:
    """Boxes by frame: one about the ball, none where it is said that there is no ball.

    A box on a plain surface is known at once; boxes that show different things are refused by the training.
    """

    def __init__(self, stills: Stills, drawn: Mapping[int, Drawn]) -> None:
        self.stills = stills
        self._drawn: dict[int, Drawn] = {frame: boxes for frame, boxes in drawn.items() if frame in stills.jpeg}
        self._plain = {frame: said for frame, boxes in self._drawn.items() if (said := self._plainness(frame, boxes))}
        self._changed = threading.Lock()

    def put(self, frame: int, sides_px: Sequence[float] | None) -> None:
        """Take what is in a frame: left, top, width, height [px], nothing for no ball, None to take it back.

        Raises ValueError for what is no box in the image.
        """
        if frame not in self.stills.jpeg:
            raise ValueError(f"frame {frame} is not among the stills")
        boxes = None if sides_px is None else (self._box(sides_px),) if sides_px else ()
        plain = None if not boxes else self._plainness(frame, boxes)
        with self._changed:
            self._drawn.pop(frame, None)
            self._plain.pop(frame, None)
            if boxes is not None:
                self._drawn[frame] = boxes
            if plain is not None:
                self._plain[frame] = plain

    def document(self) -> dict[str, Any]:
        """Return the page's whole content."""
        with self._changed:
            return {
                "width": self.stills.width_px,
                "height": self.stills.height_px,
                "count": self.stills.frames,
                "stills": list(self.stills.jpeg),
                "offered": sorted({*self.stills.offered, *self._drawn}),
                "boxes": {frame: _sides(boxes) for frame, boxes in self._drawn.items()},
                "warnings": dict(self._plain),
                "least": FEWEST_BOXES,
            }

    def missing(self) -> str | None:
        """Return the reason for which these boxes do not yet train a detector; None if they do."""
        with self._changed:
            boxed = sum(bool(boxes) for boxes in self._drawn.values())
            if boxed < FEWEST_BOXES:
                return f"{boxed} boxes are drawn: {FEWEST_BOXES} are the least"
            if self._plain:
                frames = ", ".join(map(str, sorted(self._plain)))
                return f"the boxes in frames {frames} show no ball: draw them anew or remove them"
            return None

    def write(self, film: VideoFile, folder: Path) -> tuple[int, int]:
        """Write the frames, as the film has them, with their boxes; the number of images and of boxes.

        What was drawn into this folder before and has been taken back is removed.
        """
        with self._changed:
            drawn = dict(self._drawn)
        for number, (_, pixels) in enumerate(film.frames()):
            if number in drawn:
                write_labelled(folder, _name(film, number), TrainedImage(pixels, drawn[number]))
        for number in drawn_before(film, folder):
            if number not in drawn:
                (folder / "images" / f"{_name(film, number)}.png").unlink(missing_ok=True)
                (folder / "labels" / f"{_name(film, number)}.txt").unlink()
        return len(drawn), sum(len(boxes) for boxes in drawn.values())

    def _box(self, sides_px: Sequence[float]) -> BallBox:
        left, top, width, height = sides_px
        right, bottom = min(left + width, self.stills.width_px), min(top + height, self.stills.height_px)
        left, top = max(left, 0.0), max(top, 0.0)
        if not (all(map(math.isfinite, sides_px)) and min(right - left, bottom - top) >= LEAST_SIDE_PX):
            raise ValueError(f"a box needs {LEAST_SIDE_PX:g} px of the image on each side")
        return BallBox((left + right) / 2 - 0.5, (top + bottom) / 2 - 0.5, right - left, bottom - top)

    def _plainness(self, frame: int, boxes: Drawn) -> str | None:
        least = min((box.contrast(self.stills.pixels(frame)) for box in boxes), default=math.inf)
        if least >= LEAST_CONTRAST:
            return None
        return (
            f"Bare wall? Nothing is to be seen in the box: contrast {least:.1f} of 255, a ball has {LEAST_CONTRAST:g}."
        )


def drawn_before(film: VideoFile, folder: Path) -> dict[int, Drawn]:
    """Read the boxes that ``write`` wrote of this film into the folder; raises InputError for a file without them."""
    found = {}
    for label in sorted((folder / "labels").glob("*.txt")):
        stem, _, number = label.stem.rpartition("-")
        if stem == film.name and number.isdecimal():
            found[int(number)] = read_boxes(label, film.width_px, film.height_px)
    return found


def _name(film: VideoFile, frame: int) -> str:
    return f"{film.name}-{frame:06d}"


def _sides(boxes: Drawn) -> list[float]:
    return [
        value
        for box in boxes[:1]
        for value in (
            box.u_px + 0.5 - box.width_px / 2,
            box.v_px + 0.5 - box.height_px / 2,
            box.width_px,
            box.height_px,
        )
    ]
