"""Finding the free flights in recorded tracks: where a point falls as gravity wants it to."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy.constants
from numpy.typing import NDArray

from kendama_cli.schema.arrays import Array
from kendama_cli.vision.air_path import AirPath

GRAVITY_M_S2 = scipy.constants.g
"""Standard gravity: a recording does not say where it was made, and the search bears a few percent of error."""
DOWN_M_S2 = np.array([0.0, 0.0, -GRAVITY_M_S2])
NEAR_M_S2 = 2.5
"""How far an acceleration may be from that of gravity and drag (scale, tilt, wobble, spin) and count as free fall."""
DRAGS_PER_M = (0.03, 0.06, 0.09, 0.12, 0.15, 0.18, 0.21)
"""Drag that the search tries beside none: a table-tennis ball's is 0.12, a juggling ball's 0.01."""
MORE_WITH_DRAG = 1.1
"""Drag is believed in where by it the flights are so much longer in all: slow balls give the same with any."""
SPIN_PER_S, SPUN_M_S = 3.0, 1.5
"""Most spin that the search looks for, and the speed from which on it does: slower balls feel none."""
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
class RecordedTrack:
    """One recorded point: times ``t_s`` (n,), rising, and ``position_m`` (n, 3), nan where it was not seen."""

    name: str
    t_s: Array
    position_m: Array


@dataclass(frozen=True)
class RecordedFlight:
    """Samples of one free flight, in a frame whose z points up: ``t_s`` (n,) from 0 and ``position_m`` (n, 3); and the
    drag without which it would not have been found, 0 for slow balls."""

    name: str
    begin_s: float
    t_s: Array
    position_m: Array
    drag_per_m: float = 0.0


def find_flights(tracks: Sequence[RecordedTrack], *, spin: bool = False) -> list[RecordedFlight]:
    """All free flights of ``tracks`` that end on the way down, in order of time.

    A parabola over a sliding window gives the acceleration; a flight is a stretch in which it is gravity's, made
    longer at both ends as long as the samples there are where the flight predicts them. Which axis points up follows
    from the falling itself. Of fast balls the drag is taken out of the track before: of DRAGS_PER_M that with which
    most of it flies. With ``spin`` stretches count too in which a constant spin explains what is left across the way.
    """
    pieces = [piece for track in tracks for piece in _pieces(track)]
    paths = [AirPath.of_track(piece.t_s, piece.position_m) for piece in pieces]
    best = _flights_under(pieces, paths, 0.0, spin=spin)
    needed_s = MORE_WITH_DRAG * _length_s(best)
    for drag_per_m in DRAGS_PER_M:
        found = _flights_under(pieces, paths, drag_per_m, spin=spin)
        if _length_s(found) > needed_s:
            best, needed_s = found, _length_s(found)
    return best


def _length_s(flights: Sequence[RecordedFlight]) -> float:
    return sum(float(flight.t_s[-1]) for flight in flights)


def _flights_under(
    pieces: Sequence[RecordedTrack], paths: Sequence[AirPath], drag_per_m: float, *, spin: bool
) -> list[RecordedFlight]:
    """The flights where drag is as given."""
    undragged = [
        RecordedTrack(piece.name, piece.t_s, piece.position_m + drag_per_m * path.drag_m2)
        for piece, path in zip(pieces, paths, strict=True)
    ]
    falls = [_acceleration(piece) for piece in undragged]
    turn = _upright(falls)
    if turn is None:
        return []
    found = []
    for piece, straight, fall in zip(pieces, undragged, falls, strict=True):
        points = piece.position_m @ turn.T
        upright = RecordedTrack(piece.name, piece.t_s, straight.position_m @ turn.T)
        spans = _spans(piece.t_s, upright.position_m, np.linalg.norm(fall @ turn.T - DOWN_M_S2, axis=1) < NEAR_M_S2)
        for first, last in _longest([*spans, *(_spun(upright, fall @ turn.T) if spin else ())]):
            t, flight = piece.t_s[first:last], points[first:last]
            if len(t) < 8 or t[-1] - t[0] < FLIGHT_S or flight[-1, 2] > flight[:, 2].max() - DROP_M:
                continue
            found.append(RecordedFlight(piece.name, float(t[0]), t - t[0], flight, drag_per_m))
    return sorted(found, key=lambda flight: flight.begin_s)


def _spun(piece: RecordedTrack, fall: Array) -> list[tuple[int, int]]:
    """Stretches in which what the acceleration differs by from gravity's is s x v, with one spin s each.

    Across the way s is (v x r) / |v|^2 of the rest r; its median over a stretch straightens the track.
    """
    rest = fall - DOWN_M_S2
    v = np.gradient(piece.position_m, piece.t_s, axis=0)
    speed = np.maximum(np.linalg.norm(v, axis=1), 1e-3)
    across = np.cross(v, rest) / (speed**2)[:, None]
    along = np.abs((rest * v).sum(axis=1)) / speed
    fits = (speed > SPUN_M_S) & (along < NEAR_M_S2) & (np.linalg.norm(across, axis=1) < SPIN_PER_S)
    turning = AirPath.along(piece.t_s, v).spin_ms
    found: list[tuple[int, int]] = []
    for begin, end in _runs(fits):
        if piece.t_s[end - 1] - piece.t_s[begin] < CORE_S:
            continue
        straight = RecordedTrack(
            piece.name, piece.t_s, piece.position_m - turning @ np.median(across[begin:end], axis=0)
        )
        free = np.linalg.norm(_acceleration(straight) - DOWN_M_S2, axis=1) < NEAR_M_S2
        free[:begin], free[end:] = False, False
        found += _spans(piece.t_s, straight.position_m, free)
    return found


def _longest(spans: Sequence[tuple[int, int]]) -> list[tuple[int, int]]:
    """The spans (first, last) in order, of those that overlap only the longest."""
    kept: list[tuple[int, int]] = []
    for first, last in sorted(spans, key=lambda span: span[0] - span[1]):
        if all(last <= other[0] or first >= other[1] for other in kept):
            kept.append((first, last))
    return sorted(kept)


def _pieces(track: RecordedTrack) -> list[RecordedTrack]:
    """The stretches without a gap, unseen samples left out."""
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
    """The rotation (3, 3), of quarter turns, to a frame whose z points up; None where nothing falls."""
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
    """The stretches of free fall, made longer where they go on; what then overlaps is one."""
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
