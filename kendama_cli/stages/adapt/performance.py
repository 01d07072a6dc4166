"""What adapt adds to a run's replay in space."""

from __future__ import annotations

from kendama_cli.report.replay.performance import Performance, performance
from kendama_cli.report.source import StageLog


def replay(log: StageLog) -> list[Performance]:
    """The adapted swing, as the arm played it in simulation."""
    label = "Adapted swing, simulated"
    found = performance(log, "/adapt", label, "simulation", scene="/adapt/scene")
    return [found] if found is not None else []
