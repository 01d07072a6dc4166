"""Settings of ``hardware=franka``."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import ClassVar, Literal

from kendama_cli.errors import ConfigError
from kendama_cli.schema.settings import setting


@dataclass(frozen=True)
class FrankaHardware:
    """An arm of Franka Robotics by the Franka Control Interface (FCI); every tuple is for its seven joints."""

    moves: ClassVar[bool] = True

    kind: Literal["franka"]
    host: str = setting("name or address of the arm's controller")
    realtime: Literal["enforce", "ignore"] = setting("check for a real-time kernel on this machine")
    control_period_s: float = setting("one command per period; whole milliseconds [s]", above=0, at_most=0.02)
    lower_rad: tuple[float, ...] = setting("the arm's own least angles [rad]")
    upper_rad: tuple[float, ...] = setting("the arm's own largest angles [rad]")
    velocity_rad_s: tuple[float, ...] = setting("the arm's own speed limits [rad/s]", above=0)
    acceleration_rad_s2: tuple[float, ...] = setting("the arm's own acceleration limits [rad/s^2]", above=0)
    jerk_rad_s3: tuple[float, ...] = setting("the arm's own jerk limits [rad/s^3]", above=0)
    stop_rad_s2: tuple[float, ...] = setting("with which a joint brakes toward its stop [rad/s^2]", above=0)
    stop_rad_s: tuple[float, ...] = setting("less than that braking allows, near a stop [rad/s]", at_least=0)
    collision_nm: float = setting("a joint pushed harder than this stops the arm [Nm]", above=0)
    collision_n: float = setting("a hand pushed harder than this stops the arm [N], or turned [Nm]", above=0)
    approach_rad_s: float = setting("maximum velocity of a joint on its way to the start of a motion [rad/s]", above=0)
    reply_s: float = setting("so long after an answer the next command is waited for, then the arm brakes [s]", above=0)
    silence_s: float = setting("so long without a state is a broken line [s]", above=0)
    wait_s: float = setting("time to wait for the arm at the start, and to recover [s]", above=0)

    def __post_init__(self) -> None:
        for field in fields(self):
            value = getattr(self, field.name)
            if isinstance(value, tuple) and len(value) != 7:
                raise ConfigError(field.name, f"'{field.name}' has {len(value)} values; allowed: 7, one for each joint")
        cycles = self.control_period_s / 0.001
        if abs(cycles - round(cycles)) > 1e-6:
            raise ConfigError(
                "control_period_s", f"'control_period_s' is {self.control_period_s:g}; allowed: whole milliseconds"
            )
        if self.realtime == "enforce" and self.reply_s >= 0.001:  # a simulator may have a slower clock
            raise ConfigError("reply_s", f"'reply_s' is {self.reply_s:g}; allowed: less than the arm's cycle, 0.001")
