"""Where demonstrations of the hand come from."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar, Literal, Protocol

from kendama_cli.devices.hand.axes import HANDEDNESS, Axes, Handedness, determinant, mirror_problem, to_ours
from kendama_cli.devices.streams.stream_server import StreamServer
from kendama_cli.errors import ConfigError
from kendama_cli.schema.registry import Registry
from kendama_cli.schema.settings import setting
from kendama_cli.schema.units import LengthUnit, TimeUnit

Column = int | str | None
FARTHEST_M = 50.0
"""No tracker of hands sees so far: places beyond are in another unit."""
TIMES = "even: stamps that stray from a steady rate by less than 50 ms are put there; stamps: as they are"
HANDS = Registry("kendama.demonstrators", "demonstrator")


@dataclass(frozen=True)
class ColumnSettings:
    """Which column holds what: a number (counted from ``column_base``) or a name of the header row."""

    time: int | str | None = setting("column of the time stamps; null where rate_hz tells the time")
    x: int | str | None = setting("column of x, which lies in the swing plane")
    y: int | str | None = setting("column of y, sideways; null for a swing recorded in its plane (y = 0)")
    z: int | str | None = setting("column of z, which points up")


@dataclass(frozen=True)
class RotationSettings:
    """Which columns hold the orientation's unit quaternion, as ``ColumnSettings``; all null: only places are there."""

    w: int | str | None = setting("column of its real part")
    x: int | str | None = setting("column of its part along x, whose sign is that of the place")
    y: int | str | None = setting("column of its part along y")
    z: int | str | None = setting("column of its part along z")
    upright: Literal["start", "given"] = setting(
        "start: the cup is upright where the swing begins; given: the quaternion turns the upright cup"
    )


@dataclass(frozen=True)
class SignSettings:
    """-1 turns an axis round."""

    x: Literal[1, -1] = setting("sign of x")
    y: Literal[1, -1] = setting("sign of y")
    z: Literal[1, -1] = setting("sign of z")


@dataclass(frozen=True)
class PlausibleSettings:
    """What a swing of the hand can be; outside, units or rate are taken to be wrong."""

    min_extent_m: float = setting("smallest extent of a swing along its widest axis [m]", above=0)
    max_extent_m: float = setting("largest extent of a swing along any axis [m]", above=0)
    min_peak_speed_m_s: float = setting("smallest peak speed of a swing [m/s]", above=0)
    max_speed_m_s: float = setting("largest speed between neighbouring samples [m/s]", above=0)
    max_acceleration_m_s2: float = setting("largest acceleration over 10 ms that a hand reaches [m/s^2]", above=0)
    min_duration_s: float = setting("shortest swing [s]", above=0)
    axes: Literal["refuse", "warn", "off"] = setting(
        "what to do where the hand's path is a swing along other axes than the declared ones, or under gravity turned"
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


@dataclass(frozen=True)
class BodySettings:
    """A tracked body on the cup: its axes, where the cup is in it, and what its swings can be."""

    plausible: PlausibleSettings
    axes: Axes = setting("which axis of the file is our x, y and z (up): [x, -z, y] for y up")
    body_to_cup_m: tuple[float, float, float] = setting(
        "from the body's origin to the cup's tie point, in the body's axes (kendama capture pivot) [m]"
    )
    upright: Literal["start", "given"] = setting(
        "start: the cup is upright where the recording begins; given: the body's own axes are the cup's"
    )
    max_gap_s: float = setting("longest stretch without the body that is bridged [s]", above=0)
    times: Literal["even", "stamps"] = setting(TIMES)
    segments: Literal["auto", "one"] = setting("auto: several swings in a file are cut apart where the hand rests")
    handedness: Handedness = setting(HANDEDNESS, absent="right")

    def __post_init__(self) -> None:
        to_ours(self.axes)


@dataclass(frozen=True)
class BodyCapture(BodySettings):
    """A tracked body in the files of motion capture systems and robots, and the ball where it was tracked too."""

    kind: Literal["body"] = setting("a tracked body in files")
    path: str | tuple[str, ...] | None = setting("file, glob or list of them", file=True)
    body: str | None = setting("name of the rigid body on the cup (a marker, topic or child frame); null: the only one")
    ball: str | None = setting("name of the ball's marker; null: it was not tracked")
    misses: Literal["drop", "keep"] = setting("swings after which the ball is not in the cup, where it was tracked")

    def __post_init__(self) -> None:
        if not self.path:
            raise ConfigError("path", "'path' names no recording; set it to a file, a glob or a list of files")
        super().__post_init__()


@dataclass(frozen=True)
class MarkerSettings:
    """A printed square marker on the cup's handle, and the camera that sees it."""

    plausible: PlausibleSettings
    dictionary: Literal["4x4_50", "5x5_100", "apriltag_16h5", "apriltag_36h11"] = setting("the marker's family")
    number: int = setting("its number", at_least=0)
    size_m: float = setting("side of its black square, as measured on the print: all lengths rest on it [m]", above=0)
    marker_to_cup_m: tuple[float, float, float] = setting(
        "the cup's tie point in the marker's axes: x right, y up on the print, z out of it [m]"
    )
    calibration: str | None = setting("file of 'kendama camera calibrate'; null: field_of_view_deg", file=True)
    camera: str | None = setting("name of the camera in the calibration; null: its only one")
    field_of_view_deg: float | None = setting("horizontal, of a lens without distortion", above=0, below=170)
    view: Literal["level", "calibration"] = setting(
        "level: the camera stands level and looks across the swing (x right, z up); calibration: as the file says"
    )
    rate_hz: float | None = setting(
        "frames a second when it was filmed, for slow motion; null: as the film says", above=0
    )
    max_gap_s: float = setting("longest stretch without the marker that is bridged [s]", above=0)
    segments: Literal["auto", "one"] = setting("auto: several swings in a film are cut apart where the hand rests")

    def __post_init__(self) -> None:
        if (self.calibration is None) == (self.field_of_view_deg is None):
            state = "both are null" if self.calibration is None else "both are set"
            raise ConfigError(
                "field_of_view_deg", f"'field_of_view_deg': give it or calibration, one of the two; {state}"
            )
        if self.view == "calibration" and self.calibration is None:
            raise ConfigError("view", "'view' is calibration, but no calibration file is given; allowed here: level")


@dataclass(frozen=True)
class MarkerCapture(MarkerSettings):
    """Films of the marker, one swing or several in each."""

    kind: Literal["marker"] = setting("films of a printed marker")
    path: str | tuple[str, ...] | None = setting("film, glob or list of them", file=True)

    def __post_init__(self) -> None:
        if not self.path:
            raise ConfigError("path", "'path' names no film; set it to a file, a glob or a list of files")
        super().__post_init__()


@dataclass(frozen=True)
class MarkerLiveCapture(MarkerSettings):
    """The marker before a camera that is recorded now."""

    live: ClassVar[bool] = True
    streams: ClassVar[bool] = True
    """A person swings for it: what was recorded is kept until someone asks for another recording."""

    kind: Literal["marker_live"] = setting("a printed marker before a camera")
    device: int | str = setting("the camera, a number or an address")
    record: str = setting("where its film is kept; it is never overwritten")
    seconds: float = setting("how long it is recorded [s]", above=0)


@dataclass(frozen=True)
class MocapCapture(StreamServer, BodySettings):
    """A motion capture system that streams the pose of a rigid body fixed to the cup, by OpenIGTLink or VRPN."""

    live: ClassVar[bool] = True
    streams: ClassVar[bool] = True
    """A person swings for it: what was recorded is kept until someone asks for another recording."""

    kind: Literal["mocap"] = setting("a tracked body that is streamed now")
    body: str = setting(
        "name of the rigid body on the cup: of its transform, or of its VRPN tracker (TRACKER:1 for its sensor 1)"
    )
    seconds: float = setting("how long it is recorded [s]", above=0)
    record: str = setting("where the stream is kept as it comes; it is never overwritten")

    def __post_init__(self) -> None:
        super().__post_init__()
        # before anybody swings: a stream always holds orientations
        if problem := mirror_problem(determinant(self.axes), self.handedness):
            raise ConfigError("axes", f"'axes' is {list(self.axes)}, which {problem}")


class CaptureSettingsNode(Protocol):
    """What the settings of every hand have beside fields of their own."""

    @property
    def kind(self) -> str:
        """The name under which the hand is registered."""


CaptureSettings = Annotated[CaptureSettingsNode, HANDS]
"""The node ``capture``: settings of any registered hand."""
