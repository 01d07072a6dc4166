"""What the chunks of an AVI file tell of its frames: the container counts them, and stamps none with a time."""

from __future__ import annotations

import re
import struct
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

VIDEO = re.compile(rb"\d\d(dc|db)")
IN_MOVIE = re.compile(rb"(\d\d|ix)..|JUNK|idx1|rec |LIST|RIFF", re.DOTALL)
LISTS = (b"movi", b"hdrl", b"strl", b"rec ", b"AVI ", b"AVIX", b"odml")


@dataclass(frozen=True)
class AviFacts:
    """Frames a second that the header says (0: none), and frames whose chunks follow each other from the first on.

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
