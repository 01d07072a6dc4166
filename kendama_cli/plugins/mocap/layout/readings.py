"""Readings of a recording: each body in each unit, or each triple of a table's columns at every time it may have."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from kendama_cli.devices.demonstrator.settings import FileCapture, PlausibleSettings
from kendama_cli.devices.demonstrator.text import split_rows
from kendama_cli.devices.recordings.body_track import BodyTrack
from kendama_cli.devices.recordings.recording_format import BVH, RecordingFormat
from kendama_cli.devices.recordings.text_table import exact_seconds, times
from kendama_cli.errors import InputError
from kendama_cli.plugins.mocap.layout.reading import AxisMap, Finding, Reading, rank_of
from kendama_cli.plugins.mocap.layout.table_columns import Places, Table, is_gravity
from kendama_cli.plugins.shared.recordings.reader import read_bodies
from kendama_cli.schema.arrays import Array
from kendama_cli.schema.units import METRES, SECONDS, LengthUnit

RATES_HZ = (25.0, 30.0, 50.0, 60.0, 100.0, 120.0, 200.0, 240.0, 300.0, 500.0, 1000.0)
"""Rates of cameras, trackers and controllers. The slowest of them that makes a swing is the best guess: with a faster
one, a ball rises under any motion."""
SLOWEST_HZ, FASTEST_HZ, SHORTEST_S = 12.0, 2500.0, 0.3
SEEN = 0.5
"""A body or marker that is seen in less of the frames is not the cup."""


@dataclass(frozen=True)
class _Times:
    t_s: Array
    settings: Mapping[str, Any]
    """what the YAML says of them beside the column"""
    column: int | None
    finding: Finding
    guessed: str = ""


def table_readings(path: str, text: str, base: FileCapture, rate_hz: float | None) -> list[Reading]:
    """Return the readings of a table; raises InputError where it has no columns that can be places."""
    table = Table(split_rows(path, text, base))
    found = table.places()
    places = [one for one in found if not is_gravity(_raw(table, one))]
    if not places:
        listed = ", ".join(filter(None, table.labels_alone))[:160] or f"{table.width} columns without names"
        problem = "no three columns that can be a position"
        if found:
            problem = "its columns measure accelerations: 9.8 at rest"
        remedy = "give a recording of positions; name its columns like t_s,x_m,y_m,z_m"
        raise InputError(path, f"{problem}; it has {listed}", remedy=remedy)
    timed = _times(table, rate_hz)
    return [
        _reading(path, table, one, each, unit_told)
        for one in places
        for unit_told in _units(table, one, base.plausible)
        for each in timed
    ]


def _raw(table: Table, one: Places) -> Array:
    columns = [np.zeros(len(table.values)) if k is None else table.values[:, k] for k in one.columns]
    return np.column_stack(columns)


def _units(table: Table, one: Places, plausible: PlausibleSettings) -> list[tuple[LengthUnit, str]]:
    """Return the unit that names or head tell, else each in which a swing can be as large, with what tells it."""
    if one.unit is not None:
        return [(one.unit, "the names or the row of units say so")]
    if (unit := table.unit()) is not None:
        return [(unit, "the head says so")]
    raw = _raw(table, one)
    extent = float(np.ptp(raw[np.isfinite(raw).all(axis=1)], axis=0).max())
    fitting = [unit for unit in METRES if plausible.min_extent_m <= METRES[unit] * extent <= plausible.max_extent_m]
    return [(unit, "") for unit in fitting or ["m"]]


def _times(table: Table, rate_hz: float | None) -> list[_Times]:
    """Return the times that may be meant: of a column, else at the rate that is given, told, or usual."""
    for column in table.time_columns() if rate_hz is None else ():
        if found := list(_of_column(table, column)):
            return found
    count = len(table.values)
    told = rate_hz or table.rate_hz()
    evidence = "given by --rate" if rate_hz else "the head says so"
    return [
        _Times(
            np.arange(count) / rate,
            {"rate_hz": rate},
            None,
            Finding(
                "rate",
                f"{rate:g} Hz",
                evidence if told else "no times in the file: a guess by the ball; --rate tells it",
            ),
            "" if told else f"{rate:g} Hz",
        )
        for rate in ([told] if told else RATES_HZ)
    ]


def _of_column(table: Table, column: int) -> Iterator[_Times]:
    cells, values, shown = table.cells(column), table.values[:, column], table.shown(column)
    if np.isnan(values).any():
        stamps_s = times(cells)
        if stamps_s is not None:
            yield _Times(stamps_s, {}, column, _found(shown, "dates or clock times", stamps_s))
        return
    named = table.meaning[column].time
    for unit in SECONDS:
        t_s = exact_seconds(cells, values, SECONDS[unit])
        rate_hz = (len(t_s) - 1) / max(float(t_s[-1]), 1e-12)
        if SLOWEST_HZ <= rate_hz <= FASTEST_HZ and t_s[-1] >= SHORTEST_S and named in (None, unit):
            why = "its name says so" if named else "in any other unit no tracker has such a rate"
            yield _Times(
                t_s, _unless_default("time_unit", unit, "s"), column, _found(f"{shown}, {unit}", why, t_s), unit
            )


def _found(value: str, why: str, t_s: Array) -> Finding:
    steps = np.diff(t_s)
    stray = 1e3 * float(np.percentile(np.abs(steps - np.median(steps)), 95))
    rate_hz = (len(t_s) - 1) / float(t_s[-1])
    return Finding("time", value, f"{why}; {rate_hz:.4g} Hz, {len(t_s)} rows, steps even within {stray:.1f} ms")


def _unless_default(key: str, value: Any, default: Any) -> dict[str, Any]:
    return {} if value == default else {key: value}


def _reading(path: str, table: Table, one: Places, timed: _Times, unit_told: tuple[LengthUnit, str]) -> Reading:
    unit, told = unit_told
    slower = (1 + RATES_HZ.index(timed.settings["rate_hz"])) / 100 if timed.guessed.endswith("Hz") else 0.0
    raw = _raw(table, one)
    seen = np.flatnonzero(np.isfinite(raw).all(axis=1))
    first, last = (int(seen[0]), int(seen[-1]) + 1) if len(seen) else (0, 0)
    rows = _unless_default("first_row", first + 1, 1) | _unless_default("last_row", last, len(raw))
    shown = tuple(table.shown(k) for k in one.columns)
    findings = [
        timed.finding,
        Finding(
            "position",
            ", ".join(shown),
            f"named so{f', of {one.body}' if one.body else ''}" if any(table.labels) else "they lie side by side",
        ),
    ]
    extent = float(np.ptp(METRES[unit] * raw[seen], axis=0).max()) if len(seen) else 0.0
    findings.append(Finding("unit", unit, told or f"in {unit} it extends over {extent:.2f} m, as a hand's swing does"))
    if one.turn is not None:
        findings.append(
            Finding("orientation", ", ".join(map(table.shown, one.turn)), "w first; its length is 1 in every row")
        )
    return Reading(
        one.body or ", ".join(shown),
        timed.t_s[first:last] - timed.t_s[first] if last else timed.t_s[:0],
        METRES[unit] * raw[first:last],
        (shown[0], shown[1], shown[2]),
        tuple(findings),
        _settings(path, table, one, timed, {**timed.settings, **_unless_default("unit", unit, "m"), **rows}),
        rank_of(one.body) + slower,
        slower > 0,
        " ".join(filter(None, ("" if told else unit, timed.guessed))),
    )


def _settings(
    path: str, table: Table, one: Places, timed: _Times, others: Mapping[str, Any]
) -> Callable[[AxisMap], Mapping[str, Any]]:
    def reference(column: int | None) -> int | str | None:
        return None if column is None else table.reference(column)

    def settings(axes: AxisMap) -> Mapping[str, Any]:
        columns = {name: reference(one.columns[i]) for name, (i, _) in zip("xyz", axes, strict=True)}
        signs = {name: -1 for name, (_, sign) in zip("xyz", axes, strict=True) if sign < 0}
        made: dict[str, Any] = {"kind": "file", "path": path, "columns": {"time": reference(timed.column), **columns}}
        made |= {"sign": signs} if signs else {}
        if one.turn is not None:
            w, *vector = one.turn
            made["rotation"] = {"w": reference(w)} | {
                name: reference(vector[i]) for name, (i, _) in zip("xyz", axes, strict=True)
            }
        return {**made, **others}

    return settings


def body_readings(path: str, form: RecordingFormat) -> list[Reading]:
    """Return the readings of a recording of bodies; raises InputError where none is seen for long enough."""
    units: tuple[LengthUnit | None, ...] = tuple(METRES) if form is BVH else (None,)
    tracks = [(unit, track) for unit in units for track in read_bodies(path, unit)]
    seen = [(unit, track) for unit, track in tracks if np.isfinite(track.position_m).all(axis=1).mean() >= SEEN]
    if not seen:
        problem = f"none of its {len(tracks)} bodies and markers is seen in half of the frames"
        raise InputError(path, problem, remedy="record it again, or fill the gaps in the capture program")
    return [_body_reading(path, form, track, unit, len(tracks) // len(units)) for unit, track in seen]


def _body_reading(path: str, form: RecordingFormat, track: BodyTrack, unit: LengthUnit | None, count: int) -> Reading:
    known = np.isfinite(track.position_m).all(axis=1)
    t_s = track.t_s[known] - track.t_s[known][0]
    rate_hz = (len(t_s) - 1) / max(float(t_s[-1]), 1e-9)
    turned = "with its orientation" if track.rotation_wxyz is not None else "a marker: no orientation"
    findings = (
        Finding("time", f"{rate_hz:.4g} Hz", f"{len(t_s)} frames of {form.name}"),
        Finding("body", track.name, f"one of {count}; {turned}; seen in {known.mean():.0%} of the frames"),
        Finding(
            "unit", unit or "m", f"{form.name} tells none: a guess by the ball" if unit else "the file says its unit"
        ),
    )
    settings = _body_settings(path, track.name if count > 1 else None, unit)
    places = track.position_m[known]
    return Reading(
        track.name, t_s, places, ("x", "y", "z"), findings, settings, rank_of(track.name), guessed=unit or ""
    )


def _body_settings(path: str, body: str | None, unit: LengthUnit | None) -> Callable[[AxisMap], Mapping[str, Any]]:
    def settings(axes: AxisMap) -> Mapping[str, Any]:
        made: dict[str, Any] = {"kind": "body", "path": path}
        made |= {"body": body} if body else {}
        made |= {"unit": unit} if unit else {}
        return made | {"axes": [("-" if sign < 0 else "") + "xyz"[i] for i, sign in axes]}

    return settings
