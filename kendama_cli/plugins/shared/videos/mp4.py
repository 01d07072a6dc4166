"""Display of a video by the head of its MP4: rotated, mirrored, and trimmed."""

from __future__ import annotations

import math
import struct
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, BinaryIO

MAX_BOXES = 1000
"""Of one box; what a damaged file says is not followed for ever."""
HOLDERS = (b"mdia", b"edts")


@dataclass(frozen=True)
class Mp4Facts:
    """Display of the first video track: by the matrix in its header and by its edit list.

    ``turned_deg``, clockwise, makes its images upright as the lens saw them: the flip from left to right of a matrix
    that ``is_mirrored`` is left out. ``shown_fraction`` of the track's time is shown.
    """

    turned_deg: int
    is_mirrored: bool
    shown_fraction: float


def read_mp4(path: Path) -> Mp4Facts | None:
    """Read tkhd, elst, mvhd and mdhd (ISO 14496-12); None for a file without such a video track, or a damaged one."""
    with path.open("rb") as stream:
        for name, start, end in _boxes(stream, 0, path.stat().st_size):
            if name == b"moov":
                try:
                    return _movie(stream, start, end)
                except struct.error:
                    return None
    return None


def top_boxes(path: Path) -> list[bytes]:
    """Return the names of a file's outermost boxes."""
    with path.open("rb") as stream:
        return [name for name, _, _ in _boxes(stream, 0, path.stat().st_size)]


def _boxes(stream: BinaryIO, offset: int, end: int) -> Iterator[tuple[bytes, int, int]]:
    """Yield name, first byte of the content, and end of each box between two boxes."""
    for _ in range(MAX_BOXES):
        if offset + 8 > end:
            return
        stream.seek(offset)
        length, name = struct.unpack(">I4s", stream.read(8))
        inside = offset + 8
        if length == 1:
            (length,), inside = struct.unpack(">Q", stream.read(8).rjust(8, b"\0")), offset + 16
        yield name, inside, min(offset + length, end) if length else end
        if length < 8:
            return
        offset += length


def _movie(stream: BinaryIO, start: int, end: int) -> Mp4Facts | None:
    ticks_per_s = 0
    for name, inside, stop in _boxes(stream, start, end):
        if name == b"mvhd":
            ticks_per_s, _ = _clock(stream, inside)
        if name == b"trak":
            boxes = _contents(stream, inside, stop)
            if b"tkhd" in boxes and _read(stream, ">8x4s", boxes.get(b"hdlr", (stop, stop))[0])[0] == b"vide":
                rows = _matrix(stream, boxes[b"tkhd"][0])
                shown_ticks = _shown(stream, *boxes[b"elst"]) if b"elst" in boxes else None
                per_s, whole = _clock(stream, boxes[b"mdhd"][0]) if b"mdhd" in boxes else (0, 0)
                fraction = 1.0
                if shown_ticks is not None and ticks_per_s and per_s and whole:
                    fraction = min(1.0, shown_ticks / ticks_per_s / (whole / per_s))
                return _facts(rows, fraction)
    return None


def _facts(rows: tuple[float, float, float, float], fraction: float) -> Mp4Facts:
    a, b, c, d = rows  # x' = a x + c y, y' = b x + d y
    is_mirrored = a * d - b * c < 0
    rotated = math.degrees(math.atan2(-b, -a) if is_mirrored else math.atan2(b, a))
    return Mp4Facts(90 * round(rotated / 90) % 360, is_mirrored, fraction)


def _contents(stream: BinaryIO, start: int, end: int) -> dict[bytes, tuple[int, int]]:
    """Return the boxes of a track, those of its holders too, by name."""
    found: dict[bytes, tuple[int, int]] = {}
    for name, inside, stop in _boxes(stream, start, end):
        found.setdefault(name, (inside, stop))
        if name in HOLDERS:
            found |= _contents(stream, inside, stop)
    return found


def _clock(stream: BinaryIO, inside: int) -> tuple[int, int]:
    """Return ticks a second and the duration in them, of a box 'mvhd' or 'mdhd'."""
    is_long = _read(stream, ">B", inside)[0] == 1
    per_s, ticks = _read(stream, ">20xIQ" if is_long else ">12xII", inside)
    return int(per_s), int(ticks)


def _matrix(stream: BinaryIO, inside: int) -> tuple[float, float, float, float]:
    is_long = _read(stream, ">B", inside)[0] == 1
    a, b, _, c, d = _read(stream, f">{52 if is_long else 40}x5i", inside)
    return float(a), float(b), float(c), float(d)


def _shown(stream: BinaryIO, inside: int, stop: int) -> int:
    """Return for how many ticks of the movie an edit list shows something."""
    version, count = _read(stream, ">B3xI", inside)
    layout = struct.Struct(">Qqi" if version == 1 else ">Iii")
    stream.seek(inside + 8)
    entries = stream.read(min(count * layout.size, max(stop - inside - 8, 0), MAX_BOXES * layout.size))
    whole = len(entries) // layout.size * layout.size
    return sum(ticks for ticks, since, _ in layout.iter_unpack(entries[:whole]) if since >= 0)


def _read(stream: BinaryIO, layout: str, offset: int) -> tuple[Any, ...]:
    stream.seek(offset)
    return struct.unpack(layout, stream.read(struct.calcsize(layout)))
