"""The frames of a film, each with its own time; an AVI counts them and stamps none, so its chunks are walked."""

from __future__ import annotations

import os
import re
import struct
from collections.abc import Generator, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

import cv2
import numpy as np

from kendama_cli.devices.camera.mp4 import read_mp4, top_boxes
from kendama_cli.devices.camera.pixels import open_film
from kendama_cli.errors import InputError
from kendama_cli.schema.arrays import Array
from kendama_cli.vision.detection.interface import Image

REMEDY = "convert it, e.g. to mp4 with H.264"
SLOWEST_HZ, FASTEST_HZ = 1.0, 2000.0
"""Rates beyond are no film's."""
TURNS = {90: cv2.ROTATE_90_CLOCKWISE, 180: cv2.ROTATE_180, 270: cv2.ROTATE_90_COUNTERCLOCKWISE}
# a decoder says what is wrong with every block of a damaged film; check_film tells it in one line
os.environ.setdefault("OPENCV_FFMPEG_LOGLEVEL", "-8")
VIDEO = re.compile(rb"\d\d(dc|db)")
IN_MOVIE = re.compile(rb"(\d\d|ix)..|JUNK|idx1|rec |LIST|RIFF", re.DOTALL)
LISTS = (b"movi", b"hdrl", b"strl", b"rec ", b"AVI ", b"AVIX", b"odml")


class Film:
    """A film file; frames come with the time stamps of the file (a phone's frame rate varies), turned upright as its
    metadata says, but never mirrored: a calibrated lens saw no mirror's image.

    ``turned_deg`` is by how much, clockwise. ``declared`` is how many frames the file says that it has (0 where it does
    not say), ``expected`` how many of them its edit list shows, and ``rate_hz`` how many a second, were they even.
    An AVI has no stamps: where it is damaged the film ends, for what follows has no known time.

    Raises InputError for what OpenCV cannot read as a film, or an AVI without a frame rate.
    """

    def __init__(self, path: Path) -> None:
        self.path, self.name = path, path.stem
        if not path.is_file():
            raise InputError(str(path), "no such film", remedy="give a video file per camera")
        self.avi, mp4 = read_avi(path), read_mp4(path)
        self.is_mirrored = mp4 is not None and mp4.is_mirrored
        self.turned_deg = 0 if mp4 is None else mp4.turned_deg
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
        if mp4 is None:
            self.turned_deg = round(capture.get(cv2.CAP_PROP_ORIENTATION_META)) % 360
        self.rate_hz = float(capture.get(cv2.CAP_PROP_FPS))
        self.declared = max(round(capture.get(cv2.CAP_PROP_FRAME_COUNT)), 0)
        self.expected = self.declared if mp4 is None else round(self.declared * mp4.shown_fraction)
        capture.release()

    def frames(self, every: int = 1) -> Generator[tuple[float, Image], None, None]:
        """Time [s] and pixels (h, w, 3) of every ``every``-th frame.

        A stamp that does not rise (some containers have none) is put one frame period after the one before.
        """
        for number, (t_s, capture) in enumerate(self._grabbed()):
            if number % every == 0:
                good, pixels = capture.retrieve()
                if not good:
                    return
                if self.is_mirrored and self.turned_deg in TURNS:
                    pixels = cv2.rotate(pixels, TURNS[self.turned_deg])
                yield t_s, np.asarray(pixels, dtype=np.uint8)

    def times_s(self) -> Array:
        """Time [s] of every frame that can be decoded."""
        return np.array([t_s for t_s, _ in self._grabbed()])

    def count(self) -> int:
        """Count the frames that can be decoded."""
        return len(self.times_s())

    def _grabbed(self) -> Iterator[tuple[float, cv2.VideoCapture]]:
        """Yield the time of each frame, and the capture that can decode it."""
        capture = open_film(self.path)
        if self.is_mirrored:
            capture.set(cv2.CAP_PROP_ORIENTATION_AUTO, 0)  # it takes a mirror for another turn
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
    """Return an error that says why a file is no film, as far as is seen: an MP4 has its index in the box 'moov'."""
    boxes = top_boxes(path)
    if boxes[:1] == [b"ftyp"] and b"moov" not in boxes:
        return InputError(
            str(path), "it is cut off: its index (moov) is not there", remedy="copy it again from where it was filmed"
        )
    return InputError(str(path), "OpenCV cannot read it as a film", remedy=REMEDY)


@dataclass(frozen=True)
class AviFacts:
    """Frame rate in the header (0: none), and number of frames whose chunks follow each other from the first on.

    ``damaged_byte`` is the place of the first chunk that is none. A file that is cut off is not damaged by that.
    """

    rate_hz: float
    frames: int
    damaged_byte: int | None


def read_avi(path: Path) -> AviFacts | None:
    """Walk through the chunks (Microsoft's AVI RIFF file reference); None for a file that is no AVI."""
    with path.open("rb") as stream:
        start = stream.read(12)
        if start[:4] != b"RIFF" or start[8:] != b"AVI ":
            return None
        return _walk(stream, path.stat().st_size)


def _walk(stream: BinaryIO, size: int) -> AviFacts:
    place, rate_hz, frames, end = 0, None, 0, 0
    while place + 8 <= size:
        stream.seek(place)
        name, length = struct.unpack("<4sI", stream.read(8))
        if name == b"RIFF":
            end = place + 8 + length
        if name in (b"RIFF", b"LIST") and stream.read(4) in LISTS:
            place += 12  # what it holds comes next
            continue
        if name == b"strh" and rate_hz is None and stream.read(4) == b"vids":
            header = stream.read(28)
            scale, rate = struct.unpack("<II", header[16:24]) if len(header) == 28 else (0, 0)
            rate_hz = rate / scale if scale else 0.0
        beyond = place + 8 + length > size
        if frames and (not IN_MOVIE.fullmatch(name) or (beyond and end <= size)):
            return AviFacts(rate_hz or 0.0, frames, place)
        if beyond:
            break
        frames += VIDEO.fullmatch(name) is not None
        place += 8 + length + length % 2
    return AviFacts(rate_hz or 0.0, frames, None)
