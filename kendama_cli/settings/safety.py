"""Limits that a motion must keep before an arm plays it: margins, and the space around it."""

from __future__ import annotations

from dataclasses import dataclass

from kendama_cli.errors import ConfigError
from kendama_cli.schema.settings import setting


@dataclass(frozen=True)
class SafetySettings:
    """Limits along the whole motion; positions are in the world, whose origin is on the floor below the game."""

    limit_ratio: float = setting(
        "Maximum ratio of velocity, acceleration and torque to their limits. 1 uses the full limits.",
        above=0,
        at_most=1,
    )
    to_stop_rad: float = setting("Minimum distance of a joint from its mechanical stops [rad].", at_least=0)
    gap_m: float = setting(
        "Minimum gap between two parts of the arm, or between the arm and the table [m].", at_least=0
    )
    table_height_m: float = setting(
        "Height of the table or floor; all of the arm except its pedestal stays above it [m]."
    )
    cup_low_m: tuple[float, float, float] = setting("Lower corner of the box in which the cup's tie point stays [m].")
    cup_high_m: tuple[float, float, float] = setting("Upper corner of the box in which the cup's tie point stays [m].")

    def __post_init__(self) -> None:
        if any(low >= high for low, high in zip(self.cup_low_m, self.cup_high_m, strict=True)):
            raise ConfigError(
                "cup_low_m",
                f"'cup_low_m' is {list(self.cup_low_m)}; allowed: below 'cup_high_m', {list(self.cup_high_m)}, in x, "
                "y and z",
            )
