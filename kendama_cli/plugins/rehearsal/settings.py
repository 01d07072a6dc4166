"""Settings of the stage rehearse."""

from __future__ import annotations

from dataclasses import dataclass

from kendama_cli.schema.settings import setting


@dataclass(frozen=True)
class RehearseSettings:
    """Settings of the first attempts at a motion on an arm."""

    speed: float = setting(
        "Fraction of the motion's planned speed; tau is divided by it. Start low on a real arm.", above=0, at_most=1
    )
    max_tracking_error_rad: float = setting(
        "The arm is halted when a measured joint angle deviates from the command by more than this [rad].", above=0
    )
    max_twin_deviation_rad: float = setting(
        "The arm is not moved at all if a joint of the twin deviates from the command by more than this [rad].", above=0
    )
