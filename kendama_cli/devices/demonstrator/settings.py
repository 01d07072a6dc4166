"""Settings of demonstrators: the recordings of a person's swings."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Literal

from kendama_cli.devices.demonstrator.axes import HANDEDNESS, Handedness
from kendama_cli.errors import ConfigError
from kendama_cli.schema.registry import ChosenSettings, Registry
from kendama_cli.schema.settings import setting
from kendama_cli.schema.units import LengthUnit, TimeUnit

Column = int | str | None
MAX_DISTANCE_M = 50.0
"""No tracker sees so far: positions beyond are in another unit."""
TIMES = "even: stamps that stray from a steady rate by less than 50 ms are put there; stamps: as they are"
DEMONSTRATORS = Registry("kendama.demonstrators", "demonstrator")


@dataclass(frozen=True)
class ColumnSettings:
    """Columns of the quantities: a number (counted from ``column_base``) or a name of the header row."""

    time: int | str | None = setting("column of the time stamps; null where rate_hz gives the time")
    x: int | str | None = setting("column of x, which lies in the swing plane")
    y: int | str | None = setting("column of y, sideways; null for a swing recorded in its plane (y = 0)")
    z: int | str | None = setting("column of z, which points up")


@dataclass(frozen=True)
class RotationSettings:
    """Columns of the orientation's unit quaternion, as ``ColumnSettings``; all null: only positions are there."""

    w: int | str | None = setting("column of its real part")
    x: int | str | None = setting("column of its part along x, whose sign is that of the position")
    y: int | str | None = setting("column of its part along y")
    z: int | str | None = setting("column of its part along z")
    upright: Literal["start", "given"] = setting(
        "start: the cup is upright where the swing begins; given: the quaternion rotates the upright cup"
    )


@dataclass(frozen=True)
class SignSettings:
    """Signs that flip an axis (-1)."""

    x: Literal[1, -1] = setting("sign of x")
    y: Literal[1, -1] = setting("sign of y")
    z: Literal[1, -1] = setting("sign of z")


@dataclass(frozen=True)
class PlausibleSettings:
    """Ranges of a hand's swing; outside, units or rate are assumed wrong."""

    min_extent_m: float = setting("smallest extent of a swing along its widest axis [m]", above=0)
    max_extent_m: float = setting("largest extent of a swing along any axis [m]", above=0)
    min_peak_speed_m_s: float = setting("smallest peak speed of a swing [m/s]", above=0)
    max_speed_m_s: float = setting("largest speed between neighbouring samples [m/s]", above=0)
    max_acceleration_m_s2: float = setting("largest acceleration over 10 ms that a hand reaches [m/s^2]", above=0)
    min_duration_s: float = setting("shortest swing [s]", above=0)
    axes: Literal["refuse", "warn", "off"] = setting(
        "reaction to a path that is a swing along other axes than the declared ones, or under rotated gravity"
    )


@dataclass(frozen=True)
class FileCapture:
    """Recordings read from text files (CSV, TSV, whitespace) or MCAP."""

    kind: Literal["file"]
    columns: ColumnSettings
    sign: SignSettings
    rotation: RotationSettings
    plausible: PlausibleSettings
    path: str | tuple[str, ...] | None = setting("file, glob or list of them; each is a demonstration", file=True)
    format: Literal["auto", "text", "mcap"] = setting("auto: MCAP by its magic bytes, text otherwise")
    delimiter: Literal["auto", "comma", "semicolon", "tab", "pipe", "whitespace"] = setting("between the cells")
    comment: str = setting("a line that begins with this is skipped; empty for none")
    header_rows: int | None = setting("rows before the data, the last of them the names; null: found", at_least=0)
    first_row: int = setting("first data row that is read, counted from 1", at_least=1)
    last_row: int | None = setting("last data row that is read; null: all", at_least=1)
    column_base: Literal[0, 1] = setting("number of the first column where columns are given by number")
    unit: LengthUnit = setting("unit of the positions in text files (MCAP holds metres)")
    time_unit: TimeUnit = setting("unit of the time column")
    rate_hz: float | None = setting("sampling rate where there is no time column [Hz]", above=0, at_most=1e5)
    times: Literal["even", "stamps"] = setting(TIMES, absent="even")
    gap_factor: float = setting("a time step above this multiple of the median step is a gap", above=1)
    segments: Literal["auto", "one"] = setting("auto: several swings in a file are cut apart where the hand rests")
    handedness: Handedness = setting(HANDEDNESS, absent="right")
    topic: str | None = setting("MCAP: topic of the cup's poses or transforms; null: the only one, or /capture/cup")
    child: str | None = setting("MCAP: child_frame_id of the cup; null: each child is a demonstration")

    def __post_init__(self) -> None:
        if not self.path:
            raise ConfigError("path", "'path' names no recording; set it to a file, a glob or a list of files")
        for axis in ("x", "z"):
            if getattr(self.columns, axis) is None:
                raise ConfigError(f"columns.{axis}", f"'columns.{axis}' must be a column number or name, not null")
        for axis in ("time", "x", "y", "z"):
            column = getattr(self.columns, axis)
            if isinstance(column, int) and column < self.column_base:
                raise ConfigError(
                    f"columns.{axis}",
                    f"'columns.{axis}' is {column}; allowed: at least {self.column_base} (column_base), or a name",
                )
        named = [axis for axis in "wxyz" if getattr(self.rotation, axis) is not None]
        if 0 < len(named) < 4:
            raise ConfigError(
                "rotation", f"'rotation' names the columns of {', '.join(named)} only; a quaternion has w, x, y and z"
            )
        if (self.columns.time is None) == (self.rate_hz is None):
            state = "both are null" if self.rate_hz is None else "both are set"
            raise ConfigError("rate_hz", f"'rate_hz': give it or columns.time, one of the two; {state}")
        if self.last_row is not None and self.last_row < self.first_row:
            raise ConfigError(
                "last_row", f"'last_row' is {self.last_row}; allowed: at least first_row ({self.first_row}), or null"
            )


CaptureSettings = Annotated[ChosenSettings, DEMONSTRATORS]
"""The node ``capture``: settings of any registered demonstrator."""
