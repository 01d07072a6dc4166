"""Tracks of 3-D points from C3D files (the C3D user guide, c3d.org): Intel, DEC and MIPS, integers and floats.

The tests hold it to files that ``ezc3d`` writes. It does not read through ezc3d (1.7.2): one flipped bit among a file's
parameters can end the whole process there with a segmentation fault, and a file cut in half is read without a word.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass
from itertools import chain, takewhile

import numpy as np

from kendama_cli.devices.recordings.body_track import BodyTrack
from kendama_cli.devices.recordings.recording_format import C3D_BLOCK_BYTES
from kendama_cli.errors import InputError
from kendama_cli.schema.arrays import Array
from kendama_cli.schema.units import METRES, length_unit

INTEL, DEC, MIPS = 84, 85, 86
REMEDY = "export the recording again, or as CSV with the columns t_s,x_m,y_m,z_m"


@dataclass(frozen=True)
class _Parameter:
    kind: int
    dimensions: tuple[int, ...]
    data: bytes


def read_c3d(path: str, content: bytes) -> list[BodyTrack]:
    """Read a track in metres per point; raises InputError for a file that is cut short or contradicts itself."""
    try:
        return _C3d(path, content).tracks()
    except (struct.error, IndexError, ValueError) as wrong:
        raise InputError(path, f"the C3D file is damaged ({wrong})", remedy=REMEDY) from None


class _C3d:
    def __init__(self, path: str, content: bytes) -> None:
        self._path, self._content = path, content
        begin = (content[0] - 1) * C3D_BLOCK_BYTES
        self._processor = content[begin + 3]
        if self._processor not in (INTEL, DEC, MIPS):
            raise ValueError(f"processor type {self._processor}, allowed: 84, 85, 86")
        self._order = ">" if self._processor == MIPS else "<"
        self._parameters = self._read_parameters(begin + 4, begin + C3D_BLOCK_BYTES * content[begin + 2])

    def tracks(self) -> list[BodyTrack]:
        """Return the points over time."""
        count, analog, first, last = struct.unpack_from(f"{self._order}4H", self._content, 2)
        begin = (struct.unpack_from(f"{self._order}H", self._content, 16)[0] - 1) * C3D_BLOCK_BYTES
        scale, rate_hz = self._floats(self._content[12:16])[0], self._floats(self._content[20:24])[0]
        rate_hz = self._number("POINT", "RATE") or rate_hz
        written = (self._texts("POINT", "UNITS") or ["mm"])[0]
        unit = length_unit(written)
        if count == 0:
            raise InputError(self._path, "the C3D file is empty: it has no points", remedy=REMEDY)
        if unit is None or not rate_hz > 0 or scale == 0:
            raise ValueError(f"{count} points at {rate_hz:g} Hz in '{written}' with scale {scale:g}")
        width = 4 if scale < 0 else 2
        frame = width * (4 * count + analog)
        frames, left = divmod(len(self._content) - begin, frame)
        stated = int(self._number("POINT", "FRAMES") or last - first + 1)
        if frames == 0 and stated <= 0:
            raise InputError(self._path, f"the C3D file is empty: {count} points, no frame", remedy=REMEDY)
        if frames == 0 or (frames < stated and left):  # whole frames, though fewer, are an excerpt
            raise ValueError(f"cut short: {frames} of {stated} frames are there")
        frames = min(frames, stated) if stated < 65535 else frames  # more do not fit the field
        raw = self._content[begin : begin + frames * frame]
        values = self._floats(raw) if width == 4 else np.frombuffer(raw, f"{self._order}i2").astype(np.float64)
        points = values.reshape(frames, -1)[:, : 4 * count].reshape(frames, count, 4).transpose(1, 0, 2)
        seen = points[:, :, 3] >= 0
        metres = METRES[unit] * (1.0 if scale < 0 else scale) * points[:, :, :3]
        metres[~seen] = np.nan
        # a parameter holds 255 names at most: LABELS2 goes on
        further = takewhile(bool, (self._texts("POINT", f"LABELS{i}") for i in range(2, 258)))
        names = [*self._texts("POINT", "LABELS"), *chain.from_iterable(further)]
        t_s = np.arange(frames) / rate_hz
        named = [*names, *("" for _ in range(count))]
        return [BodyTrack(named[i] or f"point {i + 1}", t_s, metres[i], None) for i in range(count)]

    def _floats(self, data: bytes) -> Array:
        if self._processor != DEC:
            return np.frombuffer(data, f"{self._order}f4").astype(np.float64)
        # DEC's floats have their halves exchanged and an exponent that is larger by two
        halves = np.frombuffer(data, "<u2").reshape(-1, 2)[:, ::-1]
        return np.ascontiguousarray(halves).view("<f4")[:, 0].astype(np.float64) / 4

    def _read_parameters(self, at: int, end: int) -> dict[tuple[str, str], _Parameter]:
        """Read all parameters by group and name; a group has a negative number, its parameters the same, positive."""
        content = self._content
        groups: dict[int, str] = {}
        found: list[tuple[int, str, _Parameter]] = []
        while at < end:
            length, number = abs(struct.unpack_from("b", content, at)[0]), struct.unpack_from("b", content, at + 1)[0]
            if length == 0 or number == 0:
                break
            name = content[at + 2 : at + 2 + length].decode("latin-1").upper()
            at += 2 + length
            (skip,) = struct.unpack_from(f"{self._order}H", content, at)
            if number < 0:
                groups[-number] = name
            else:
                kind, rank = struct.unpack_from("bB", content, at + 2)
                dimensions = tuple(content[at + 4 : at + 4 + rank])
                size = abs(kind) * int(np.prod(dimensions, dtype=np.int64))
                begin = at + 4 + rank
                found.append((number, name, _Parameter(kind, dimensions, content[begin : begin + size])))
            if skip == 0:
                break
            at += skip
        return {(groups.get(number, ""), name): parameter for number, name, parameter in found}

    def _texts(self, group: str, name: str) -> list[str]:
        parameter = self._parameters.get((group, name))
        if parameter is None or parameter.kind != -1 or not parameter.dimensions:
            return []
        width = max(parameter.dimensions[0], 1)
        text = parameter.data.decode("latin-1")
        return [text[i : i + width].strip(" \t\0") for i in range(0, len(text), width)]

    def _number(self, group: str, name: str) -> float | None:
        parameter = self._parameters.get((group, name))
        if parameter is None or not parameter.data:
            return None
        if parameter.kind == 4:
            return float(self._floats(parameter.data[:4])[0])
        return float(struct.unpack_from(f"{self._order}H", parameter.data)[0]) if parameter.kind == 2 else None
