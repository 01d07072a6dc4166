"""Part of a run's replay in space by learn."""

from __future__ import annotations

from kendama_cli.report.replay.performance import Performance, performance
from kendama_cli.report.source import StageLog


def replay(log: StageLog) -> list[Performance]:
    """Return the learned swing-up without noise: cup and ball, with the cup on its line."""
    found = performance(log, "/learn", "Learned swing-up, simulated", "simulation")
    return [found] if found is not None else []
