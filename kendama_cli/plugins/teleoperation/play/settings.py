"""Settings of the play in the browser, and of the demonstrations that come of it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from kendama_cli.devices.demonstrator.settings import FileCapture
from kendama_cli.errors import ConfigError
from kendama_cli.schema.settings import setting


@dataclass(frozen=True)
class PlayCapture(FileCapture):
    """Attempts that ``kendama play`` stored, read like any recording; their first lines mark catches and choices."""

    kind: Literal["play"]  # type: ignore[assignment]
    path: str | tuple[str, ...] | None = setting(
        "Stored attempts: a file, glob or list of them.", file=True, made_by="'kendama play' keeps tries there"
    )
    take: Literal["chosen", "caught", "all"] = setting(
        "Attempts to take: those chosen on the page, all that caught, or all."
    )


@dataclass(frozen=True)
class EaseSettings:
    """Limits to which a player may ease the game."""

    min_gravity_fraction: float = setting(
        "Minimum gravity that a player may choose, as a fraction of the game's.", above=0, at_most=1
    )
    rope_scale: tuple[float, float] = setting(
        "Minimum and maximum length of the rope that a player may choose, as fractions of the game's.", above=0
    )
    max_cup_scale: float = setting(
        "Maximum width of the cup that a player may choose, as a multiple of the game's.", at_least=1
    )


@dataclass(frozen=True)
class ReachSettings:
    """Region that the cup can be dragged to, from its start."""

    lateral_m: float = setting("Maximum displacement of the cup to either side [m].", above=0)
    down_m: float = setting("Maximum displacement of the cup downwards [m].", above=0)
    up_m: float = setting("Maximum displacement of the cup upwards [m].", above=0)
    tilt_rad: float = setting("Maximum tilt of the cup to either side [rad].", at_least=0)


@dataclass(frozen=True)
class PlaySettings:
    """Simulation and files of ``kendama play``."""

    ease: EaseSettings
    reach: ReachSettings
    folder: str = setting("Folder of the attempts, with a folder for every player.")
    smoothing_s: float = setting(
        "Half width, and delay, of the filter over the hand's samples [s]. A larger value is smoother and slower.",
        above=0,
    )
    caught_s: float = setting("The ball counts as caught when it has been in the cup for this long [s].", above=0)
    max_attempt_s: float = setting("An attempt ends after this time [s].", above=1)
    pause_s: float = setting("An attempt ends when the hand has sent nothing for longer than this [s].", above=0.02)
    max_players: int = setting("Maximum number of players at once.", at_least=1)
    max_attempts: int = setting("Maximum number of attempts in one player's folder.", at_least=1)

    def __post_init__(self) -> None:
        shortest, longest = self.ease.rope_scale
        if shortest > longest:
            raise ConfigError("ease.rope_scale", f"'ease.rope_scale' is [{shortest}, {longest}]; allowed: rising")
