"""Search for free flights in recorded tracks: stretches in which a point accelerates as under gravity."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy.constants
from numpy.typing import NDArray

from kendama_cli.plugins.shared.recordings.reader import RecordedTrack
from kendama_cli.schema.arrays import Array

GRAVITY_M_S2 = scipy.constants.g
"""Standard gravity: a recording does not say where it was made, and the search bears a few percent of error."""
DOWN_M_S2 = np.array([0.0, 0.0, -GRAVITY_M_S2])
NEAR_M_S2 = 2.5
"""Greatest deviation of a free fall's acceleration from gravity and drag (scale, tilt, wobble)."""
SURE_M_S2 = 0.4
"""The window is made so long that noise disturbs the acceleration by no more (standard deviation)."""
WINDOW_S = (0.12, 0.30)
GAP_S = 0.05
"""A longer time without a sample ends a flight."""
CORE_S, FLIGHT_S = 0.08, 0.2
"""The shortest stretch that is looked at, and the shortest whole flight [s]."""
DROP_M = 0.05
"""A flight ends at least so far under its apex: nearer to it the time of a crossing is not determined."""
EDGE_S = 0.15
"""So much of a flight predicts the samples beside it."""


@dataclass(frozen=True)
class RecordedFlight:
    """Samples of one free flight, in a frame whose z points up: ``t_s`` (n,) from 0 and ``position_m`` (n, 3)."""

    name: str
    begin_s: float
    t_s: Array
    position_m: Array


def find_flights(tracks: Sequence[RecordedTrack]) -> list[RecordedFlight]:
    """Return all free flights of ``tracks`` that end on the way down, in order of time.

    A parabola over a sliding window gives the acceleration; a flight is a stretch in which it is gravity's, extended
    at both ends while the flight predicts the samples there. The axis that points up follows
    from the fall itself.
    """
    return [flight for flight in _all_flights(tracks) if _falls(flight)]


def left_rising(tracks: Sequence[RecordedTrack]) -> int:
    """Return the number of free flights that leave the volume, or are lost, before they fall."""
    return sum(not _falls(flight) for flight in _all_flights(tracks))


def _falls(flight: RecordedFlight) -> bool:
    heights = flight.position_m[:, 2]
    return bool(heights[-1] <= heights.max() - DROP_M)


def _all_flights(tracks: Sequence[RecordedTrack]) -> list[RecordedFlight]:
    pieces = [piece for track in tracks for piece in _pieces(track)]
    falls = [_acceleration(piece) for piece in pieces]
    rotation = _upright(falls)
    if rotation is None:
        return []
    found = []
    for piece, fall in zip(pieces, falls, strict=True):
        points = piece.position_m @ rotation.T
        free = np.linalg.norm(fall @ rotation.T - DOWN_M_S2, axis=1) < NEAR_M_S2
        for first, last in _spans(piece.t_s, points, free):
            t, flight = piece.t_s[first:last], points[first:last]
            if len(t) >= 8 and t[-1] - t[0] >= FLIGHT_S:
                found.append(RecordedFlight(piece.name, float(t[0]), t - t[0], flight))
    return sorted(found, key=lambda flight: flight.begin_s)


def _pieces(track: RecordedTrack) -> list[RecordedTrack]:
    """Return the stretches without a gap, unseen samples left out."""
    seen = np.isfinite(track.position_m).all(axis=1)
    t, points = track.t_s[seen], track.position_m[seen]
    cuts = np.flatnonzero(np.diff(t) > GAP_S) + 1
    parts = zip(np.split(t, cuts), np.split(points, cuts), strict=True)
    return [RecordedTrack(track.name, s, p) for s, p in parts if len(s) >= 8 and s[-1] - s[0] >= FLIGHT_S]


def _acceleration(piece: RecordedTrack) -> Array:
    """Second derivative (n, 3) of a parabola about every sample; nan within half a window of the ends."""
    t, points = piece.t_s, piece.position_m
    step = (t[-1] - t[0]) / (len(t) - 1)
    even = t[0] + step * np.arange(len(t))
    values = np.column_stack([np.interp(even, t, points[:, axis]) for axis in range(3)])
    # sigma of the acceleration is sqrt(720 step / window) sigma / window^2
    noise = np.abs(np.diff(values, n=3, axis=0))
    sigma = float(np.median(noise, axis=0).max()) / 0.6745 / math.sqrt(20) if len(values) > 8 else 0.0
    window = (math.sqrt(720 * step) * sigma / SURE_M_S2) ** 0.4
    half = max(2, round(min(max(window, WINDOW_S[0]), WINDOW_S[1]) / 2 / step))
    fall = np.full_like(points, np.nan)
    if len(t) <= 2 * half:
        return fall
    s = step * np.arange(-half, half + 1)
    second = 2 * np.linalg.pinv(np.column_stack([np.ones_like(s), s, s * s]))[2]
    for axis in range(3):
        fall[half:-half, axis] = np.convolve(values[:, axis], second, mode="valid")  # the weights are even
    return fall


def _upright(falls: Sequence[Array]) -> Array | None:
    """Return the rotation (3, 3), of quarter turns, to a frame whose z points up; None if nothing falls."""
    falling = [fall[np.abs(np.linalg.norm(fall, axis=1) - GRAVITY_M_S2) < NEAR_M_S2] for fall in falls]
    together = np.concatenate([np.empty((0, 3)), *falling])
    counts = [int((sign * together[:, axis] > 0.95 * GRAVITY_M_S2).sum()) for axis in range(3) for sign in (-1, 1)]
    if max(counts) == 0:
        return None
    axis, sign = divmod(int(np.argmax(counts)), 2)
    up = np.roll(np.eye(3), 2 - axis, axis=0)  # a cyclic change of axes keeps the handedness
    return up if sign == 0 else np.asarray(np.diag([1.0, -1.0, -1.0]) @ up)


def _runs(mask: NDArray[np.bool_]) -> list[tuple[int, int]]:
    edges = np.flatnonzero(np.diff(np.concatenate([[0], mask.astype(np.int8), [0]])))
    return list(zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True))


def _spans(t: Array, points: Array, free: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """Return the stretches of free fall, extended where they go on; those that then overlap are one."""
    spans: list[tuple[int, int]] = []
    for begin, end in _runs(free):
        if t[end - 1] - t[begin] < CORE_S:
            continue
        first, last = _extended(t, points, begin, end)
        if spans and first <= spans[-1][1]:
            first, last = spans.pop()[0], max(last, end)
        spans.append((first, last))
    return spans


def _extended(t: Array, points: Array, begin: int, end: int) -> tuple[int, int]:
    """``begin`` and ``end`` moved outward over samples that the flight beside them predicts."""
    last = end
    near = slice(max(begin, int(np.searchsorted(t, t[end - 1] - EDGE_S))), end)
    foretold = _Edge(t[near], points[near])
    while last < len(t) and t[last] - t[end - 1] < EDGE_S and foretold.holds(t[last], points[last]):
        last += 1
    first = begin
    near = slice(begin, min(end, int(np.searchsorted(t, t[begin] + EDGE_S)) + 1))
    foretold = _Edge(t[near], points[near])
    while first > 0 and t[begin] - t[first - 1] < EDGE_S and foretold.holds(t[first - 1], points[first - 1]):
        first -= 1
    # what lets go of a ball does so little by little: only where nothing was seen of it is the beginning moved; at
    # the end, the sample next to one that does not fit may be touched by what moved that one
    return 0 if first == 0 else begin, last - (last > end)


class _Edge:
    """A short stretch of flight under standard gravity, and whether a sample beside it belongs to it."""

    def __init__(self, t: Array, points: Array) -> None:
        s = t - t.mean()
        self._middle_s = float(t.mean())
        degree = 2 if len(t) > 12 else 1
        fall = np.array([0.0, 0.0, -GRAVITY_M_S2 / 2])
        self._fall = fall if degree == 1 else np.zeros(3)
        design = s[:, None] ** np.arange(degree + 1)
        flat = points - s[:, None] ** 2 * self._fall
        self._weights = np.linalg.lstsq(design, flat, rcond=None)[0]
        left = flat - design @ self._weights
        self._inverse = np.linalg.inv(design.T @ design)
        self._sigma_m = math.sqrt(float((left**2).sum()) / max(3 * (len(t) - degree - 1), 1)) + 1e-4

    def holds(self, t_s: float, point: Array) -> bool:
        """Within four standard deviations of what the stretch predicts, its own uncertainty included."""
        s = t_s - self._middle_s
        row = s ** np.arange(len(self._weights))
        off = float(np.linalg.norm(point - row @ self._weights - s * s * self._fall))
        return bool(off < 4 * self._sigma_m * math.sqrt(1 + float(row @ self._inverse @ row)))
