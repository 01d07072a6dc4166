"""Settings of ``capture=phone``."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from kendama_cli.devices.demonstrator.settings import TIMES, PlausibleSettings
from kendama_cli.errors import ConfigError
from kendama_cli.schema.settings import setting


@dataclass(frozen=True)
class PhoneColumns:
    """Names of the columns of a table that no known app wrote; all null: found by their names."""

    time: str | None = setting("Name of the column of time.")
    ax: str | None = setting("Name of the column of the acceleration along the sensor's x, gravity included.")
    ay: str | None = setting("Name of the column of the acceleration along y.")
    az: str | None = setting("Name of the column of the acceleration along z.")
    wx: str | None = setting(
        "Name of the column of the rotation rate about x. It is in rad/s unless its name says deg/s."
    )
    wy: str | None = setting("Name of the column of the rotation rate about y.")
    wz: str | None = setting("Name of the column of the rotation rate about z.")

    def __post_init__(self) -> None:
        named = [key for key in ("time", "ax", "ay", "az", "wx", "wy", "wz") if getattr(self, key) is not None]
        if 0 < len(named) < 7:
            raise ConfigError("time", f"'time' and six more: name all seven columns or none; named: {', '.join(named)}")


@dataclass(frozen=True)
class PhoneCapture:
    """Recordings of a phone's accelerometer (with gravity) and gyroscope, held as the cup and swung."""

    columns: PhoneColumns
    plausible: PlausibleSettings
    kind: Literal["phone"] = setting("The inertial sensors of a phone, recorded by an app.")
    path: str | tuple[str, ...] | None = setting(
        "Recording: a zip, a table, a glob such as FOLDER/*.csv, or a list of these.", file=True
    )
    sign: Literal[1, -1] | None = setting(
        "Sign of the accelerations. -1 is for files in which rest reads -9.8 upwards (iOS, unless standardised). null "
        "takes the sign of the app."
    )
    sensor_in_cup_m: tuple[float, float, float] = setting(
        "Vector from the cup's tie point to the sensor, in the axes of the upright cup: x in the swing plane, z up [m]."
    )
    max_gap_s: float = setting("During a motion, gaps in the samples up to this are bridged [s].", above=0)
    times: Literal["even", "stamps"] = setting(TIMES)
    segments: Literal["auto", "one"] = setting(
        "With 'auto', several swings of a file are cut apart where the hand rests; with 'one', all is one swing."
    )

    def __post_init__(self) -> None:
        if not self.path:
            raise ConfigError("path", "'path' names no recording; set it to a zip, a table, a glob or a list of them")
