"""Images and videos of others: frames with their own times, faults, and a limit of size before they are decoded.

An AVI counts its frames and stamps none, so its chunks are walked.
"""

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

from kendama_cli import MOST_PIXELS
from kendama_cli.errors import InputError
from kendama_cli.plugins.shared.videos.mp4 import read_mp4, top_boxes
from kendama_cli.schema.arrays import Array
from kendama_cli.vision.detection.interface import Image

SIZE = f"of at most {MOST_PIXELS // 1_000_000} million pixels"


def read_image(path: Path, where: str = "") -> Image:
    """Return pixels (h, w, 3), blue, green, red; raises InputError for what OpenCV cannot read."""
    try:
        coded = np.fromfile(path, dtype=np.uint8)
        pixels = cv2.imdecode(coded, cv2.IMREAD_COLOR) if len(coded) else None
    except OSError as error:
        raise InputError(str(path), f"the image cannot be read ({error.strerror})", where=where) from None
    except cv2.error:  # beyond the limit that kendama_cli sets
        raise InputError(str(path), f"it is not an image {SIZE}", where=where, remedy="scale it down") from None
    if pixels is None:
        problem = "it is not an image that OpenCV can read"
        raise InputError(str(path), problem, where=where, remedy="remove or convert it")
    return np.asarray(pixels, dtype=np.uint8)


def open_capture(path: str | os.PathLike[str]) -> cv2.VideoCapture:
    """Return OpenCV's reader of a video, which may not be open; raises InputError where its frames are too large."""
    video = cv2.VideoCapture(os.fspath(path))
    width, height = video.get(cv2.CAP_PROP_FRAME_WIDTH), video.get(cv2.CAP_PROP_FRAME_HEIGHT)
    if width * height > MOST_PIXELS:
        video.release()
        problem = f"its frames are {width:.0f} x {height:.0f} px; allowed: {SIZE.removeprefix('of ')}"
        raise InputError(os.fspath(path), problem, remedy="convert it to a smaller one")
    return video


REMEDY = "convert it, e.g. to mp4 with H.264"
MIN_HZ, MAX_HZ = 1.0, 2000.0
"""Plausible frame rates of a video."""
TURNS = {90: cv2.ROTATE_90_CLOCKWISE, 180: cv2.ROTATE_180, 270: cv2.ROTATE_90_COUNTERCLOCKWISE}
# a decoder says what is wrong with every block of a damaged video; video_faults says it in one line
os.environ.setdefault("OPENCV_FFMPEG_LOGLEVEL", "-8")
VIDEO = re.compile(rb"\d\d(dc|db)")
IN_MOVIE = re.compile(rb"(\d\d|ix)..|JUNK|idx1|rec |LIST|RIFF", re.DOTALL)
LISTS = (b"movi", b"hdrl", b"strl", b"rec ", b"AVI ", b"AVIX", b"odml")


class VideoFile:
    """A video file; frames come with the time stamps of the file (a phone's frame rate varies), rotated upright as its
    metadata says, but never mirrored: a calibrated lens saw no mirror's image.

    ``turned_deg`` is by how much, clockwise. ``declared`` is how many frames the file says that it has (0 where it does
    not say), ``expected`` how many of them its edit list shows, and ``rate_hz`` how many a second, were they even.
    An AVI has no stamps: where it is damaged the video ends, for what follows has no known time.

    Raises InputError for what OpenCV cannot read as a video, or an AVI without a frame rate.
    """

    def __init__(self, path: Path) -> None:
        self.path, self.name = path, path.stem
        if not path.is_file():
            raise InputError(str(path), "no such video", remedy="give a video file per camera")
        self.avi, mp4 = read_avi(path), read_mp4(path)
        self.is_mirrored = mp4 is not None and mp4.is_mirrored
        self.turned_deg = 0 if mp4 is None else mp4.turned_deg
        first = next(self.frames(), None)
        if first is None:
            raise _unreadable(path)
        if self.avi is not None and not MIN_HZ <= self.avi.rate_hz <= MAX_HZ:
            raise InputError(
                str(path),
                f"its header says {self.avi.rate_hz:g} frames per second, so its times are not known",
                remedy=f"give it the rate it was recorded at, e.g. ffmpeg -r 30 -i {path} {path.with_suffix('.mp4')}",
            )
        self.width_px, self.height_px = first[1].shape[1], first[1].shape[0]
        capture = open_capture(path)
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
        capture = open_capture(self.path)
        if self.is_mirrored:
            capture.set(cv2.CAP_PROP_ORIENTATION_AUTO, 0)  # it takes a mirror for another rotation
        damaged = self.avi is not None and self.avi.damaged_byte is not None
        known = self.avi.frames if self.avi is not None and damaged else None
        try:
            rate_hz = capture.get(cv2.CAP_PROP_FPS)
            period_s = 1 / rate_hz if MIN_HZ <= rate_hz <= MAX_HZ else 1 / 30
            before_s, number = -period_s, 0
            while number != known and capture.grab():
                t_s = capture.get(cv2.CAP_PROP_POS_MSEC) / 1e3
                before_s = t_s if t_s > before_s else before_s + period_s
                yield before_s, capture
                number += 1
        finally:
            capture.release()


def _unreadable(path: Path) -> InputError:
    """Return an error that says why a file is no video, as far as is seen: an MP4 has its index in the box 'moov'."""
    boxes = top_boxes(path)
    if boxes[:1] == [b"ftyp"] and b"moov" not in boxes:
        return InputError(
            str(path), "it is cut off: its index (moov) is not there", remedy="copy it again from where it was recorded"
        )
    return InputError(str(path), "OpenCV cannot read it as a video", remedy=REMEDY)


@dataclass(frozen=True)
class AviFacts:
    """Frame rate in the header (0: none), and number of frames whose chunks follow each other from the first on.

    ``damaged_byte`` is the offset of the first chunk that is invalid. A file that is cut off is not damaged by that.
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
    offset, rate_hz, frames, end = 0, None, 0, 0
    while offset + 8 <= size:
        stream.seek(offset)
        name, length = struct.unpack("<4sI", stream.read(8))
        if name == b"RIFF":
            end = offset + 8 + length
        if name in (b"RIFF", b"LIST") and stream.read(4) in LISTS:
            offset += 12  # what it holds comes next
            continue
        if name == b"strh" and rate_hz is None and stream.read(4) == b"vids":
            header = stream.read(28)
            scale, rate = struct.unpack("<II", header[16:24]) if len(header) == 28 else (0, 0)
            rate_hz = rate / scale if scale else 0.0
        beyond = offset + 8 + length > size
        if frames and (not IN_MOVIE.fullmatch(name) or (beyond and end <= size)):
            return AviFacts(rate_hz or 0.0, frames, offset)
        if beyond:
            break
        frames += VIDEO.fullmatch(name) is not None
        offset += 8 + length + length % 2
    return AviFacts(rate_hz or 0.0, frames, None)


COUNTED = (".avi", ".mp4", ".m4v", ".mov")
"""Containers that count their frames; others estimate them from duration and rate."""
ROUNDED = 2
"""Frames by which a count from the durations in an edit list may be off."""
EVEN = 1.5
"""Frames are evenly spaced where the widest gap is less than so many times the median one."""


def shown_otherwise(video: VideoFile) -> Iterator[str]:
    """Yield a line about each difference of a video's display, by its metadata, from what was taken."""
    if video.turned_deg:
        lines = "run upwards" if video.turned_deg == 180 else "are columns"
        yield (
            f"{video.path}: it is rotated by {video.turned_deg}° as its metadata says, to {video.width_px} x "
            f"{video.height_px} px: only a calibration by videos rotated alike fits, a rolling shutter's lines {lines}"
        )
    if video.is_mirrored:
        yield f"{video.path}: its metadata mirrors it, which is left out: positions are as the lens saw them"


def video_faults(video: VideoFile, times_s: Array) -> Iterator[str]:
    """Yield a line about each fault of a video of which the frames at ``times_s`` (n,) can be read."""
    yield from shown_otherwise(video)
    frames, declared, expected = len(times_s), video.declared, video.expected
    if trimmed := expected < declared - ROUNDED:
        yield f"{video.path}: it is trimmed: its edit list shows about {expected} of its {declared} frames"
    if video.avi is not None and video.avi.damaged_byte is not None:
        yield (
            f"{video.path}: it is damaged at byte {video.avi.damaged_byte}, after {frames} of its {declared} frames; "
            "an AVI does not say when a frame was taken, so what follows is left out"
        )
    elif video.path.suffix.lower() in COUNTED and frames < (expected - ROUNDED if trimmed else declared):
        yield f"{video.path}: {frames} of its {expected} frames can be read: it is cut off or damaged; copy it again"
    gaps_s = np.diff(times_s)
    if not len(gaps_s):
        return
    usual_s, widest_s = float(np.median(gaps_s)), float(gaps_s.max())
    if widest_s > EVEN * usual_s:
        uneven = int(np.count_nonzero(gaps_s > EVEN * usual_s))
        yield (
            f"{video.path}: its frames are not evenly spaced ({1e3 * usual_s:.3g} ms, but {uneven} gaps of up to "
            f"{1e3 * widest_s:.3g} ms): each has its own time, but the ball may be lost in the gaps"
        )
