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

    time: str | None = setting("time")
    ax: str | None = setting("acceleration with gravity along the sensor's x")
    ay: str | None = setting("the same along y")
    az: str | None = setting("the same along z")
    wx: str | None = setting("rotation rate about the sensor's x, in rad/s unless its name says deg/s")
    wy: str | None = setting("the same about y")
    wz: str | None = setting("the same about z")

    def __post_init__(self) -> None:
        named = [key for key in ("time", "ax", "ay", "az", "wx", "wy", "wz") if getattr(self, key) is not None]
        if 0 < len(named) < 7:
            raise ConfigError("time", f"'time' and six more: name all seven columns or none; named: {', '.join(named)}")


@dataclass(frozen=True)
class PhoneCapture:
    """Recordings of a phone's accelerometer (with gravity) and gyroscope, held as the cup and swung."""

    columns: PhoneColumns
    plausible: PlausibleSettings
    kind: Literal["phone"] = setting("a phone's inertial sensors, recorded by an app")
    path: str | tuple[str, ...] | None = setting("zip, table, glob (FOLDER/*.csv) or list", file=True)
    sign: Literal[1, -1] | None = setting(
        "sign of the accelerations: -1 where rest reads -9.8 upwards (iOS, unless standardised); null: the app's own"
    )
    sensor_in_cup_m: tuple[float, float, float] = setting(
        "vector from the cup's tie point to the sensor, in the axes of the upright cup: x in the swing plane, z up [m]"
    )
    max_gap_s: float = setting("longest stretch without a sample that is bridged during a motion [s]", above=0)
    times: Literal["even", "stamps"] = setting(TIMES)
    segments: Literal["auto", "one"] = setting("auto: several swings in a file are cut apart where the hand rests")

    def __post_init__(self) -> None:
        if not self.path:
            raise ConfigError("path", "'path' names no recording; set it to a zip, a table, a glob or a list of them")
