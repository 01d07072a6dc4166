"""What learn adds to a run's replay in space."""

from __future__ import annotations

from kendama_cli.report.replay.performance import Performance, performance
from kendama_cli.report.source import StageLog


def replay(log: StageLog) -> list[Performance]:
    """The learned swing-up without noise: cup and ball, the cup carried on its line."""
    found = performance(log, "/learn", "Learned swing-up, simulated", "simulation")
    return [found] if found is not None else []
