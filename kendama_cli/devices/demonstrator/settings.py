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
TIMES = (
    "Use of the time stamps: 'even' moves stamps to a steady rate if they deviate from it by less than 50 ms, "
    "'stamps' takes them unchanged."
)
DEMONSTRATORS = Registry("kendama.demonstrators", "demonstrator")


@dataclass(frozen=True)
class ColumnSettings:
    """Columns of the quantities: a number (counted from ``column_base``) or a name of the header row."""

    time: int | str | None = setting("Column of the time stamps; null if rate_hz gives the time.")
    x: int | str | None = setting("Column of x, the horizontal axis in the swing plane.")
    y: int | str | None = setting(
        "Column of y, the axis across the swing plane; null for a swing recorded in the plane (y = 0)."
    )
    z: int | str | None = setting("Column of z, the axis that points up.")


@dataclass(frozen=True)
class RotationSettings:
    """Columns of the orientation's unit quaternion, as ``ColumnSettings``; all null: only positions are there."""

    w: int | str | None = setting("Column of the quaternion's real part.")
    x: int | str | None = setting("Column of the quaternion's x component, which has the sign of the position's x.")
    y: int | str | None = setting("Column of the quaternion's y component.")
    z: int | str | None = setting("Column of the quaternion's z component.")
    upright: Literal["start", "given"] = setting(
        "Reference of the orientation: 'start' takes the cup as upright where the swing starts, 'given' takes the "
        "quaternion as the rotation from the upright cup."
    )


@dataclass(frozen=True)
class SignSettings:
    """Signs that flip an axis (-1)."""

    x: Literal[1, -1] = setting("Sign of x; -1 flips the axis.")
    y: Literal[1, -1] = setting("Sign of y; -1 flips the axis.")
    z: Literal[1, -1] = setting("Sign of z; -1 flips the axis.")


@dataclass(frozen=True)
class PlausibleSettings:
    """Ranges of a hand's swing; outside, units or rate are assumed wrong."""

    min_extent_m: float = setting(
        "Minimum extent of a swing along its longest axis [m]. Smaller ones point to a wrong unit.", above=0
    )
    max_extent_m: float = setting(
        "Maximum extent of a swing along any axis [m]. Larger ones point to a wrong unit.", above=0
    )
    min_peak_speed_m_s: float = setting(
        "Minimum peak speed of a swing [m/s]. Slower ones point to a wrong unit or rate.", above=0
    )
    max_speed_m_s: float = setting(
        "Maximum speed between neighbouring samples [m/s]. Higher ones point to a wrong unit or rate.", above=0
    )
    max_acceleration_m_s2: float = setting("Maximum acceleration over 10 ms that a hand reaches [m/s^2].", above=0)
    min_duration_s: float = setting("Minimum duration of a swing [s].", above=0)
    axes: Literal["refuse", "warn", "off"] = setting(
        "Reaction to a path that looks like a swing along other axes than the declared ones, or under rotated gravity."
    )


@dataclass(frozen=True)
class FileCapture:
    """Recordings read from text files (CSV, TSV, whitespace) or MCAP."""

    kind: Literal["file"]
    columns: ColumnSettings
    sign: SignSettings
    rotation: RotationSettings
    plausible: PlausibleSettings
    path: str | tuple[str, ...] | None = setting(
        "File, glob or list of files; each file is one demonstration or more.", file=True
    )
    format: Literal["auto", "text", "mcap"] = setting(
        "Format of the files; 'auto' recognises MCAP by its first bytes and takes all others as text."
    )
    delimiter: Literal["auto", "comma", "semicolon", "tab", "pipe", "whitespace"] = setting(
        "Character between the cells; 'auto' finds it."
    )
    comment: str = setting("Lines that start with this are skipped; leave it empty if there are none.")
    header_rows: int | None = setting(
        "Number of rows before the data, of which the last names the columns; null finds it.", at_least=0
    )
    first_row: int = setting("First data row that is read, counted from 1.", at_least=1)
    last_row: int | None = setting("Last data row that is read; null reads all.", at_least=1)
    column_base: Literal[0, 1] = setting("Number of the first column if columns are given by number.")
    unit: LengthUnit = setting("Unit of the positions in text files; MCAP holds metres.")
    time_unit: TimeUnit = setting("Unit of the time column.")
    rate_hz: float | None = setting("Sampling rate if there is no time column [Hz].", above=0, at_most=1e5)
    times: Literal["even", "stamps"] = setting(TIMES, absent="even")
    gap_factor: float = setting("A time step longer than this multiple of the median step counts as a gap.", above=1)
    segments: Literal["auto", "one"] = setting(
        "Swings in one file: 'auto' splits it where the hand rests, 'one' takes it as one swing."
    )
    handedness: Handedness = setting(HANDEDNESS, absent="right")
    topic: str | None = setting(
        "MCAP topic of the cup's poses or transforms; null takes the only one, or /capture/cup."
    )
    child: str | None = setting("MCAP child_frame_id of the cup; null takes each child frame as a demonstration.")

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
