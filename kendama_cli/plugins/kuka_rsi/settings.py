"""Settings of ``hardware=rsi``."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Literal

from kendama_cli.errors import ConfigError
from kendama_cli.schema.settings import setting


@dataclass(frozen=True)
class RsiHardware:
    """A KUKA controller with RobotSensorInterface (RSI) over UDP."""

    moves: ClassVar[bool] = True

    kind: Literal["rsi"]
    host: str = setting("Address of this machine to which the controller sends.")
    port: int = setting("UDP port of this machine.", above=0, at_most=65535)
    controller: str = setting("Address of the controller; packets from other addresses are ignored.")
    sentype: str = setting("Name of this system in the controller's configuration (SENTYPE).")
    control_period_s: float = setting("Cycle of the controller: 0.004 or 0.012 [s].", above=0, at_most=0.02)
    signs: tuple[Literal[-1, 1], ...] | None = setting(
        "Signs of axes A1 to A6: -1 where the robot description rotates the other way; null for none."
    )
    offset_deg: tuple[float, ...] | None = setting(
        "Angles of the controller where those of the robot description are 0 [deg]; null for 0."
    )
    max_correction_deg: float = setting(
        "Maximum displacement of an axis from its position at the start of RSI [deg].", above=0
    )
    approach_rad_s: float = setting(
        "Maximum velocity of a joint while the arm moves to the start of a motion [rad/s].", above=0
    )
    reply_s: float = setting(
        "The answer to a telegram leaves after this time, with a new command or without one [s].", above=0
    )
    silence_s: float = setting(
        "The controller counts as stopped when no telegram has arrived for this long [s].", above=0
    )
    wait_s: float = setting("Time to wait for the first telegram [s].", above=0)

    def __post_init__(self) -> None:
        for name in ("signs", "offset_deg"):
            values = getattr(self, name)
            if values is not None and len(values) != 6:
                raise ConfigError(name, f"'{name}' has {len(values)} values; allowed: 6, one for each axis, or null")
        if self.reply_s >= self.control_period_s:
            allowed = f"allowed: less than the control period, {self.control_period_s:g}"
            raise ConfigError("reply_s", f"'reply_s' is {self.reply_s:g}; {allowed}")
