"""Settings of ``hardware=rsi``."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Literal

from kendama_cli.errors import ConfigError
from kendama_cli.schema.settings import setting


@dataclass(frozen=True)
class RsiHardware:
    """A KUKA controller that runs RobotSensorInterface (RSI) over UDP."""

    moves: ClassVar[bool] = True

    kind: Literal["rsi"]
    host: str = setting("address of this machine to which the controller sends")
    port: int = setting("UDP port of this machine", above=0, at_most=65535)
    controller: str = setting("address of the controller; what others send is ignored")
    sentype: str = setting("name of this system in the controller's configuration (SENTYPE)")
    control_period_s: float = setting("the controller's cycle: 0.004 or 0.012 [s]", above=0, at_most=0.02)
    signs: tuple[Literal[-1, 1], ...] | None = setting(
        "signs of A1 to A6: -1 where the description turns the other way; null: nowhere"
    )
    offset_deg: tuple[float, ...] | None = setting(
        "the controller's angles where the description's are 0; null: 0 [deg]"
    )
    max_correction_deg: float = setting("maximum displacement of an axis from the start of RSI [deg]", above=0)
    approach_rad_s: float = setting("maximum velocity of a joint on its way to the start of a motion [rad/s]", above=0)
    reply_s: float = setting("an answer leaves so soon after the telegram, with a new command or without [s]", above=0)
    silence_s: float = setting("so long without a telegram is a stopped controller [s]", above=0)
    wait_s: float = setting("time to wait for the first telegram [s]", above=0)

    def __post_init__(self) -> None:
        for name in ("signs", "offset_deg"):
            values = getattr(self, name)
            if values is not None and len(values) != 6:
                raise ConfigError(name, f"'{name}' has {len(values)} values; allowed: 6, one for each axis, or null")
        if self.reply_s >= self.control_period_s:
            allowed = f"allowed: less than the control period, {self.control_period_s:g}"
            raise ConfigError("reply_s", f"'reply_s' is {self.reply_s:g}; {allowed}")
