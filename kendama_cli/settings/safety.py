"""Limits that a motion must keep before an arm plays it: margins, and the space around it."""

from __future__ import annotations

from dataclasses import dataclass

from kendama_cli.errors import ConfigError
from kendama_cli.schema.settings import setting


@dataclass(frozen=True)
class SafetySettings:
    """Allowed along the whole motion; places are in the world, whose origin is where the table of the game stands."""

    limit_ratio: float = setting("maximum fraction of a speed, acceleration or effort limit", above=0, at_most=1)
    to_stop_rad: float = setting("minimum distance of a joint from its stops [rad]", at_least=0)
    gap_m: float = setting("minimum gap between two parts of the arm, or to the table [m]", at_least=0)
    table_height_m: float = setting("height of the table or floor over which all but the pedestal stays [m]")
    cup_low_m: tuple[float, float, float] = setting("lower corner of the box that the cup's tie point stays in [m]")
    cup_high_m: tuple[float, float, float] = setting("upper corner of that box [m]")

    def __post_init__(self) -> None:
        if any(low >= high for low, high in zip(self.cup_low_m, self.cup_high_m, strict=True)):
            raise ConfigError(
                "cup_low_m",
                f"'cup_low_m' is {list(self.cup_low_m)}; allowed: below 'cup_high_m', {list(self.cup_high_m)}, in x, "
                "y and z",
            )
