"""Say what data is of: who or what made the swings, and which robot was driven."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

_SWINGS = {
    "synthetic": "Synthetic swings, made by a program: no person was recorded.",
    "person": "A person's swings.",
}
_ROBOTS = {"twin": "the twin", "simulated": "the simulated arm"}


def swings_of(metrics: Mapping[str, Any]) -> str:
    """Return the sentence for capture's metric ``origin``, which the head of the recordings says."""
    origin = str(metrics.get("origin") or "")
    return _SWINGS.get(origin, f"Swings of the origin '{origin}'." if origin else "Whose swings they are is not told.")


def robot_of(settings: Mapping[str, Any]) -> str:
    """Return what to call the robot that the stage of these ``settings`` drove."""
    hardware = settings.get("hardware")
    kind = hardware.get("kind") if isinstance(hardware, Mapping) else None
    return "the robot" if kind is None else _ROBOTS.get(str(kind), f"the robot of hardware={kind}")
