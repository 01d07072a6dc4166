"""Settings of the stage rehearse."""

from __future__ import annotations

from dataclasses import dataclass

from kendama_cli.schema.settings import setting


@dataclass(frozen=True)
class RehearseSettings:
    """Settings of the first attempts of a motion on an arm."""

    speed: float = setting("fraction of the motion's own speed; its tau is divided by it", above=0, at_most=1)
    max_tracking_error_rad: float = setting(
        "a joint measured farther from what was sent to it halts the arm [rad]", above=0
    )
    max_twin_deviation_rad: float = setting(
        "a joint of the twin farther from what is commanded keeps the arm from being moved [rad]", above=0
    )
