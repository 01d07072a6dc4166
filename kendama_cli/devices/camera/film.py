"""The frames of a film, each with its own time."""

from __future__ import annotations

import os
import struct
from collections.abc import Iterator
from pathlib import Path

import cv2
import numpy as np

from kendama_cli.devices.camera.avi import read_avi
from kendama_cli.devices.camera.pixels import open_film
from kendama_cli.errors import InputError
from kendama_cli.schema.arrays import Array
from kendama_cli.vision.interface import Image

REMEDY = "convert it, e.g. to mp4 with H.264"
SLOWEST_HZ, FASTEST_HZ = 1.0, 2000.0
"""Rates beyond are no film's."""
MOST_BOXES = 1000
# a decoder says what is wrong with every block of a damaged film; check_film tells it in one line
os.environ.setdefault("OPENCV_FFMPEG_LOGLEVEL", "-8")


class Film:
    """A film file; frames come with the time stamps of the file (a phone's frame rate varies), turned upright as its
    metadata says.

    ``turned_deg`` is by how much, ``declared`` how many frames the file says that it has (0 where it does not say).
    An AVI has no stamps: where it is damaged the film ends, for what follows has no known time.

    Raises InputError for what OpenCV cannot read as a film, or an AVI without a frame rate.
    """

    def __init__(self, path: Path) -> None:
        self.path, self.name = path, path.stem
        if not path.is_file():
            raise InputError(str(path), "no such film", remedy="give a video file per camera")
        self.avi = read_avi(path)
        first = next(self.frames(), None)
        if first is None:
            raise _unreadable(path)
        if self.avi is not None and not SLOWEST_HZ <= self.avi.rate_hz <= FASTEST_HZ:
            raise InputError(
                str(path),
                f"its header says {self.avi.rate_hz:g} frames per second, so its times are not known",
                remedy=f"give it the rate it was filmed at, e.g. ffmpeg -r 30 -i {path} {path.with_suffix('.mp4')}",
            )
        self.width_px, self.height_px = first[1].shape[1], first[1].shape[0]
        capture = open_film(path)
        self.turned_deg = round(capture.get(cv2.CAP_PROP_ORIENTATION_META)) % 360
        self.declared = max(round(capture.get(cv2.CAP_PROP_FRAME_COUNT)), 0)
        capture.release()

    def frames(self, every: int = 1) -> Iterator[tuple[float, Image]]:
        """Time [s] and pixels (h, w, 3) of every ``every``-th frame.

        A stamp that does not rise (some containers have none) is put one frame period after the one before.
        """
        for number, (t_s, capture) in enumerate(self._grabbed()):
            if number % every == 0:
                good, pixels = capture.retrieve()
                if not good:
                    return
                yield t_s, np.asarray(pixels, dtype=np.uint8)

    def times_s(self) -> Array:
        """Time [s] of every frame that can be decoded."""
        return np.array([t_s for t_s, _ in self._grabbed()])

    def count(self) -> int:
        """Number of frames that can be decoded."""
        return len(self.times_s())

    def _grabbed(self) -> Iterator[tuple[float, cv2.VideoCapture]]:
        """The time of each frame, and the capture that can decode it."""
        capture = open_film(self.path)
        damaged = self.avi is not None and self.avi.damaged_byte is not None
        known = self.avi.frames if self.avi is not None and damaged else None
        try:
            rate_hz = capture.get(cv2.CAP_PROP_FPS)
            period_s = 1 / rate_hz if SLOWEST_HZ <= rate_hz <= FASTEST_HZ else 1 / 30
            before_s, number = -period_s, 0
            while number != known and capture.grab():
                t_s = capture.get(cv2.CAP_PROP_POS_MSEC) / 1e3
                before_s = t_s if t_s > before_s else before_s + period_s
                yield before_s, capture
                number += 1
        finally:
            capture.release()


def _unreadable(path: Path) -> InputError:
    """Why a file is no film, as far as that is seen: an MP4 has its index, often at its end, in the box 'moov'."""
    with path.open("rb") as stream:
        boxes: list[bytes] = []
        place, size = 0, path.stat().st_size
        while place + 8 <= size and len(boxes) < MOST_BOXES:
            stream.seek(place)
            length, name = struct.unpack(">I4s", stream.read(8))
            if length == 1:
                (length,) = struct.unpack(">Q", stream.read(8).rjust(8, b"\0"))
            boxes.append(name)
            place = place + length if length >= 8 else size
    if boxes[:1] == [b"ftyp"] and b"moov" not in boxes:
        return InputError(
            str(path), "it is cut off: its index (moov) is not there", remedy="copy it again from where it was filmed"
        )
    return InputError(str(path), "OpenCV cannot read it as a film", remedy=REMEDY)
