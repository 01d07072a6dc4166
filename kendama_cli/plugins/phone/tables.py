"""Quantities in the tables of the apps: acceleration with gravity and rotation rate, each with its own time.

Sources: phyphox (head "Time (s)","X (m/s^2)" or "Acceleration x (m/s^2)"), Sensor Logger's README, UNITS and
COORDINATES (columns z, y, x; signs of iOS), MATLAB Mobile (timestamp,X,Y,Z), Physics Toolbox (time,gFx,...,wx,...).
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from kendama_cli.devices.demonstrator.tidy import even_times
from kendama_cli.devices.recordings.text_table import times
from kendama_cli.errors import InputError
from kendama_cli.plugins.phone.files import EXPORT, Export, Table
from kendama_cli.plugins.phone.settings import PhoneCapture
from kendama_cli.schema.arrays import Array

MIN_HZ, MAX_HZ = 45.0, 1100.0
"""A swing is resolved from 50 Hz on; phones give up to 500 Hz, and chips 1000 Hz."""
MIN_TIMES = 21
MAX_VALUE = 1e6
"""Beyond any sensor in any unit."""
LATE_STEPS = 5
"""A phone hands samples over late by so many; a clock that was set back by more mixes the samples."""
WHOLE = 10**15
"""A float holds whole numbers up to here exactly; of larger stamps (ns since 1970) a multiple is taken away."""
DAY_NS = 86_400 * 10**9
SECONDS = (1.0, 1e-3, 1e-6, 1e-9)
ACCELERATION, LINEAR, RATE = "acceleration", "linear acceleration", "rotation rate"
WITH_GRAVITY = (
    "record the accelerometer with gravity: phyphox: 'Acceleration with g' and 'Gyroscope' in one experiment (+, "
    "simple experiment); Sensor Logger: switch on 'Total Acceleration'; Physics Toolbox: 'g-Force Meter' and "
    "'Gyroscope' in 'Multi Record'"
)


@dataclass(frozen=True)
class Signal:
    """One sensor: times (n,) [s] and values (n, 3) along its own axes, as the file has them; ``unit`` as written."""

    path: str
    t_s: Array
    values: Array
    unit: str


def signals_of(export: Export, settings: PhoneCapture) -> tuple[Signal, Signal]:
    """Return acceleration and rotation rate of an app's export.

    Raises InputError for a table without one of them, and for acceleration without gravity alone.
    """
    found: dict[str, tuple[Table, list[str]]] = {}
    kinds = [(table, kind, names) for table in export.tables for kind, names in _quantities(table, settings).items()]
    for table, kind, names in sorted(kinds, key=_behind):
        first, _ = found.setdefault(kind, (table, names))
        if first is not table and _unnumbered(first) == _unnumbered(table):
            raise InputError(
                export.path,
                f"{first.stem} and {table.stem} hold the {kind} twice",
                remedy="give each recording a folder of its own",
            )
    if ACCELERATION not in found and LINEAR in found:
        raise InputError(found[LINEAR][0].path, "holds acceleration without gravity", remedy=WITH_GRAVITY)
    for kind, sensor in ((ACCELERATION, "accelerometer"), (RATE, "gyroscope")):
        if kind not in found:
            seen = ", ".join(f"{one.stem} ({', '.join(map(str, one.frame.columns[:8]))})" for one in export.tables[:6])
            raise InputError(
                export.tables[0].path if len(export.tables) == 1 else export.path,
                f"no {kind} found in {seen}",
                remedy=f"record the {sensor} too, give both files (capture.path='DIR/*.csv') or name capture.columns",
            )
    force, rate = (_signal(*found[kind], settings) for kind in (ACCELERATION, RATE))
    return force, rate


def recordings_in(export: Export, settings: PhoneCapture) -> list[Export]:
    """Return ``export``, or each of its tables by itself where several hold both sensors."""
    whole = [one for one in export.tables if {ACCELERATION, RATE} <= set(_quantities(one, settings))]
    return [Export(one.path, one.stem, (one,)) for one in whole] if len(whole) > 1 else [export]


def _behind(found: tuple[Table, str, list[str]]) -> tuple[bool, bool]:
    """Return the order in which tables of one quantity are taken: with rows, and calibrated ones, first."""
    return len(found[0].frame) == 0, found[0].stem.lower().endswith("uncalibrated")


def _unnumbered(table: Table) -> str:
    """Return a file's name without the number that a program gives to a second one."""
    return re.sub(r"[\W\d]+$", "", table.stem)


def gravity_sign(export: Export, settings: PhoneCapture) -> float:
    """Return -1 where the app writes accelerations with the other sign.

    Sensor Logger does so on iOS unless its values are standardised, which Metadata.csv tells. Raises InputError where
    that file is missing, for a wrong sign mirrors the path unnoticed.
    """
    if settings.sign is not None:
        return float(settings.sign)
    if not any("seconds_elapsed" in table.frame.columns for table in export.tables):
        return 1.0
    facts = next(
        (table.frame for table in export.tables if table.stem.lower() == "metadata" and len(table.frame)), None
    )
    if facts is None or "platform" not in facts.columns:
        raise InputError(
            export.path,
            "Sensor Logger's Metadata.csv is missing, which tells the sign of the acceleration",
            remedy="give the whole export, or set capture.sign=1 (Android, or standardised) or -1 (iOS)",
        )
    standard = str(facts["standardisation"].iloc[0]).lower() == "true" if "standardisation" in facts.columns else False
    return -1.0 if "ios" in str(facts["platform"].iloc[0]).lower() and not standard else 1.0


def _quantities(table: Table, settings: PhoneCapture) -> dict[str, list[str]]:
    """Return the columns of time, x, y and z by quantity."""
    columns, named = [str(name) for name in table.frame.columns], settings.columns
    if named.time is not None:
        chosen = [str(getattr(named, key)) for key in ("time", "ax", "ay", "az", "wx", "wy", "wz")]
        if missing := [name for name in chosen if name not in columns]:
            problem = f"no column '{missing[0]}'; it has {', '.join(columns[:20])}"
            raise InputError(table.path, problem, remedy="name the columns in capture.columns as the file does")
        return {ACCELERATION: chosen[:4], RATE: [chosen[0], *chosen[4:]]}
    time = next(
        (one for one in columns if re.match(r"(seconds_elapsed|time|timestamp|t)\b|t_|.*\(m?s\)$", one, re.I)), None
    )
    found: dict[str, dict[str, str]] = {}
    for name in columns:
        if name != time and (read := _axis_of(name, table)) is not None:
            found.setdefault(read[0], {}).setdefault(read[1], name)
    return {kind: [time, *(axes[one] for one in "xyz")] for kind, axes in found.items() if time and len(axes) == 3}


def _axis_of(name: str, table: Table) -> tuple[str, str] | None:
    """Return quantity and axis of a column by its name and unit, and by its file's name; None for any other."""
    plain = re.sub(r"[(\[].*|_(m_s2|rad_s|deg_s|g)$", "", name).strip().lower()
    word, axis = re.sub(r"[^a-z]", "", plain[:-1]), plain[-1:]
    stem = re.sub(r"[^a-z]", "", table.stem.lower())
    unit = _unit(name)
    if axis not in ("x", "y", "z") or re.search(r"mag|grav|orient|quat|abs|^q$|^b$", word):
        return None
    about = word or stem
    if "lin" in about or "user" in about or "withoutg" in about or (not word and "lin" in stem):
        return LINEAR, axis
    logger = "seconds_elapsed" in table.frame.columns
    if logger and stem == "accelerometer":
        return LINEAR, axis
    if unit in ("rad", "deg") or re.match(r"gyr|ang|rot|omega|w$", about):
        return RATE, axis
    if unit == "m" or re.match(r"acc|tot|gf|a$|f$", about):
        return ACCELERATION, axis
    return None


def _unit(name: str) -> str:
    """Return rad, deg or m for the unit in a column's name; empty where it has none."""
    if re.search(r"deg|°", name):
        return "deg"
    return "rad" if "rad" in name else "m" if re.search(r"m/s|m_s2|ms-2", name) else ""


def _signal(table: Table, names: Sequence[str], settings: PhoneCapture) -> Signal:
    frame = table.frame
    if table.problem is not None:
        raise InputError(table.path, table.problem, remedy=EXPORT)
    try:
        values = frame[list(names[1:])].to_numpy(dtype=np.float64)
    except (ValueError, TypeError) as wrong:
        raise InputError(table.path, f"holds what is no number ({str(wrong)[:80]})", remedy="export it again") from None
    t_s = _seconds(table, names[0])
    kept = (np.abs(values) < MAX_VALUE).all(axis=1) & np.isfinite(t_s)  # no nan either
    t_s, values, rows = t_s[kept], values[kept], np.flatnonzero(kept) + 1
    once = np.sort(np.unique(np.column_stack([t_s, values]), axis=0, return_index=True)[1])
    t_s, values, rows = t_s[once], values[once], rows[once]
    if len(different := np.unique(t_s)) < MIN_TIMES:
        problem = f"{len(different)} different times with numbers beside them, in {len(frame)} rows"
        raise InputError(table.path, problem, remedy="record the swing again")
    step = float(np.median(np.diff(different)))
    late = np.maximum.accumulate(t_s) - t_s
    if late.max() > LATE_STEPS * step:
        raise InputError(
            table.path,
            f"the times go back, to {late[late > LATE_STEPS * step][0] / step:.0f} samples before",
            where=f"row {rows[late > LATE_STEPS * step][0]}",
            remedy="record the swing again",
        )
    order = np.argsort(t_s, kind="stable")
    t_s, values = t_s[order], values[order]
    unit_s = next((one for one in SECONDS if MIN_HZ <= 1 / (one * step) <= MAX_HZ), None)
    if unit_s is None:
        raise InputError(
            table.path,
            f"samples come every {step:.4g}, in seconds or parts of it; 50 to 500 Hz are needed",
            remedy="set the app to 100 Hz or its fastest rate and record again",
        )
    t_s = t_s * unit_s
    even = even_times(t_s) if settings.times == "even" else None
    if even is None:
        t_s, first = np.unique(t_s, return_index=True)  # of repeated stamps the first
        values = values[first]
    return Signal(table.path, t_s if even is None else even, values, _unit(names[1]))


def _seconds(table: Table, name: str) -> Array:
    """Return a column of times as numbers in its own unit, exactly where they are whole."""
    import pandas as pd  # noqa: PLC0415 - a second to import

    column = table.frame[name]
    if pd.api.types.is_integer_dtype(column):
        return np.asarray(column.to_numpy(dtype=np.int64) - WHOLE * (int(column.iloc[0]) // WHOLE), np.float64)
    if pd.api.types.is_numeric_dtype(column):
        return column.to_numpy(dtype=np.float64)
    cells = [str(one).strip() for one in column]
    try:
        stamps = pd.to_datetime(pd.Series(cells), format="%d-%b-%Y %H:%M:%S.%f").to_numpy(dtype="datetime64[ns]")
    except ValueError:
        if (found := times(cells)) is None:
            raise InputError(table.path, f"'{cells[0]}' is no time", where=f"column {name}") from None
        return found
    return np.asarray(stamps.astype(np.int64) % (DAY_NS * 1000) * 1e-9)
