"""Settings of the play in the browser, and of the demonstrations that come of it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from kendama_cli.devices.demonstrator.settings import FileCapture
from kendama_cli.errors import ConfigError
from kendama_cli.schema.settings import setting


@dataclass(frozen=True)
class PlayCapture(FileCapture):
    """Tries that ``kendama play`` kept; read as any recording, with the marks in their first lines."""

    kind: Literal["play"]  # type: ignore[assignment]
    path: str | tuple[str, ...] | None = setting(
        "tries that were kept; a file, glob or list of them", file=True, made_by="'kendama play' keeps tries there"
    )
    take: Literal["chosen", "caught", "all"] = setting("tries to take: those chosen on the page, all caught, or all")


@dataclass(frozen=True)
class EaseSettings:
    """Limits to which a player may ease the game."""

    min_gravity_fraction: float = setting("least gravity, as a share of the game's", above=0, at_most=1)
    rope_scale: tuple[float, float] = setting("shortest and longest rope, as shares of the game's", above=0)
    max_cup_scale: float = setting("widest cup, as a multiple of the game's", at_least=1)


@dataclass(frozen=True)
class ReachSettings:
    """Region that the cup can be dragged to, from its start."""

    lateral_m: float = setting("reach to either side [m]", above=0)
    down_m: float = setting("down [m]", above=0)
    up_m: float = setting("up [m]", above=0)
    tilt_rad: float = setting("leaning to either side [rad]", at_least=0)


@dataclass(frozen=True)
class PlaySettings:
    """Simulation and files of ``kendama play``."""

    ease: EaseSettings
    reach: ReachSettings
    folder: str = setting("folder of the tries, with a folder for every player")
    smoothing_s: float = setting("half width of the filter over the hand's samples, and its delay [s]", above=0)
    caught_s: float = setting("a ball that lies in the cup for this long is caught [s]", above=0)
    max_attempt_s: float = setting("a try ends after this time [s]", above=1)
    pause_s: float = setting("a longer silence of the hand ends the try [s]", above=0.02)
    max_players: int = setting("players at once", at_least=1)
    max_attempts: int = setting("tries that one player's folder may hold", at_least=1)

    def __post_init__(self) -> None:
        shortest, longest = self.ease.rope_scale
        if shortest > longest:
            raise ConfigError("ease.rope_scale", f"'ease.rope_scale' is [{shortest}, {longest}]; allowed: rising")
