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

    streams: ClassVar[bool] = True
    """Its progress is told: the seconds of a recording, the images that were read of a video."""

    plausible: PlausibleSettings
    dictionary: Literal["4x4_50", "5x5_100", "apriltag_16h5", "apriltag_36h11"] = setting(
        "Dictionary of square markers from which the printed one is."
    )
    number: int = setting("Number of the marker in its dictionary.", at_least=0)
    size_m: float = setting(
        "Side of the marker's black square, measured on the print [m]. All lengths scale with it.", above=0
    )
    marker_to_cup_m: tuple[float, float, float] = setting(
        "Tie point of the rope in the marker's axes: x to the right, y up on the print, z out of it [m]."
    )
    calibration: str | None = setting("File by 'kendama camera calibrate'; null takes an undistorted lens.", file=True)
    camera: str | None = setting("Name of the camera in the calibration; null takes its only one.")
    field_of_view_deg: float | None = setting(
        "Horizontal field of view of a lens without distortion [deg]; depth alone scales with it. null takes 65 along "
        "the image's longer side.",
        above=0,
        below=170,
    )
    view: Literal["level", "calibration"] = setting(
        "Pose of the camera: 'level' stands level and looks across the swing (x right, z up), 'calibration' takes "
        "that of the file."
    )
    rate_hz: float | None = setting(
        "Images per second at which a slow-motion video was recorded [Hz]; null takes the rate of the video.", above=0
    )
    max_gap_s: float = setting(
        "Gaps without the marker of up to this duration are interpolated, longer ones refused [s].", above=0
    )
    segments: Literal["auto", "one"] = setting(
        "Swings in one video: 'auto' splits it where the hand rests, 'one' takes it as one swing."
    )

    def __post_init__(self) -> None:
        if self.calibration is not None and self.field_of_view_deg is not None:
            raise ConfigError(
                "field_of_view_deg", "'field_of_view_deg': give it or calibration, one of the two; both are set"
            )
        if self.view == "calibration" and self.calibration is None:
            raise ConfigError("view", "'view' is calibration, but no calibration file is given; allowed here: level")


@dataclass(frozen=True)
class MarkerCapture(MarkerSettings):
    """Videos of the marker, each with one swing or several."""

    kind: Literal["marker"] = setting("The demonstrations are videos of a printed marker.")
    path: str | tuple[str, ...] | None = setting("Video, glob or list of them.", file=True)

    def __post_init__(self) -> None:
        if not self.path:
            raise ConfigError("path", "'path' names no film; set it to a file, a glob or a list of files")
        super().__post_init__()


@dataclass(frozen=True)
class MarkerLiveCapture(MarkerSettings):
    """A live recording of the marker by a camera."""

    live: ClassVar[bool] = True
    """A person swings for it: what was recorded is kept until someone asks for another recording."""

    kind: Literal["marker_live"] = setting("A printed marker is recorded by a live camera.")
    device: int | str = setting("Camera to record, as a number or an address.")
    record: str = setting("File of the recorded video, which is never overwritten.")
    seconds: float = setting("Duration of the recording [s].", above=0)
