"""Settings of ``capture=marker`` and ``capture=marker_live``."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Literal

from kendama_cli.devices.demonstrator.settings import PlausibleSettings
from kendama_cli.errors import ConfigError
from kendama_cli.schema.settings import setting


@dataclass(frozen=True)
class MarkerSettings:
    """A printed square marker on the cup's handle, and the camera that sees it."""

    plausible: PlausibleSettings
    dictionary: Literal["4x4_50", "5x5_100", "apriltag_16h5", "apriltag_36h11"] = setting("the marker's family")
    number: int = setting("number of the marker", at_least=0)
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
    record: str = setting("file of its video; it is never overwritten")
    seconds: float = setting("duration of the recording [s]", above=0)
