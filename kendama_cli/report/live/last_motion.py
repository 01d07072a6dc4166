"""The last motion in a log that still grows, whichever stage writes it: its newest cup and ball."""

from __future__ import annotations

from kendama_cli.errors import KendamaError
from kendama_cli.report.replay.performance import Kind, Performance, performance
from kendama_cli.report.source import StageLog
from kendama_cli.report.tracks import last_start_s
from kendama_cli.schema.foxglove import FrameTransform


def last_motion(log: StageLog, label: str, kind: Kind) -> Performance | None:
    """The last stretch of the ball that moved last, with its cup and whatever else stands beside it."""
    topics = log.topics_under("/")
    ends = {}
    for topic in topics:
        under = topic.removesuffix("/ball")
        if under != topic and f"{under}/cup" in topics:
            balls = log.table(topic, FrameTransform)
            if len(balls):
                ends[under] = float(balls["t_s"].iloc[-1])
    if not ends:
        return None
    under = max(ends, key=lambda one: ends[one])
    scenes = [topic for topic in topics if topic.endswith("/scene") and under.startswith(topic.removesuffix("/scene"))]
    start_s = last_start_s(log.table(f"{under}/ball", FrameTransform))
    try:
        return performance(log, under, label, kind, scene=max(scenes, default=None, key=len), start_s=start_s)
    except KendamaError:  # a stage of another package, whose settings do not say how large the game is
        return None
