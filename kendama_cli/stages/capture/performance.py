"""Part of a run's replay in space by capture."""

from __future__ import annotations

from kendama_cli.report.replay.performance import Performance, cup_alone
from kendama_cli.report.source import StageLog
from kendama_cli.schema.foxglove import FrameTransform


def replay(log: StageLog) -> list[Performance]:
    """Return the first demonstration: the cup alone."""
    cups = log.table("/capture/cup", FrameTransform)
    if cups.empty:
        return []
    name = min(cups["child"])
    origin = log.metrics.get("origin")
    found = cup_alone(cups[cups["child"] == name], f"Demonstration {name}" + (f" ({origin})" if origin else ""))
    return [found] if found is not None else []
