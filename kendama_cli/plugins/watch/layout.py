"""A layout with which Foxglove opens a log: the scene in space, the images, and a plot for each topic of numbers."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pandas as pd

from kendama_cli.log.reader import LogFile

WORLD = "world"
MAX_LINES = 8
"""More lines in one plot are no picture."""
_PLACED = ("foxglove.FrameTransform", "foxglove.FrameTransforms", "foxglove.SceneUpdate")
_IMAGES, _JOINTS = "foxglove.CompressedImage", "foxglove.JointStates"


def layout(path: Path | str) -> dict[str, Any]:
    """Return Foxglove's layout for the log ``path``, as its import takes it; raises InputError for a bad log.

    The scene stands to the left where frames are logged; to the right the images, over tabs of plots.
    """
    log, panels = LogFile(path), _Panels()
    schemas = {topic: log.channel(topic).schema_name for topic in log.topics}
    images = [panels.image(topic) for topic, schema in schemas.items() if schema == _IMAGES]
    lines = {topic: _lines(log, topic, schema) for topic, schema in schemas.items()}
    tabs = [(topic, panels.plot(topic, paths)) for topic, paths in lines.items() if paths]
    right = [*([_split("row", images)] if images else []), *([panels.tabs(tabs)] if tabs else [])]
    scenes = [topic for topic, schema in schemas.items() if schema in _PLACED]
    columns = [*([panels.scene(scenes)] if scenes else []), *([_split("column", right)] if right else [])]
    return {
        "configById": panels.by_id,
        "globalVariables": {},
        "userNodes": {},
        "playbackConfig": {"speed": 1},
        "layout": _split("row", columns or [panels.source()]),
    }


class _Panels:
    """The panels made so far: settings by id, which is a kind, ! and a name."""

    def __init__(self) -> None:
        self.by_id: dict[str, dict[str, Any]] = {}

    def scene(self, topics: list[str]) -> str:
        shown = {topic: {"visible": True} for topic in topics}
        grid = {"layerId": "foxglove.Grid", "instanceId": "grid", "frameId": WORLD, "visible": True, "size": 4}
        return self._add("3D", "scene", {"followTf": WORLD, "topics": shown, "layers": {"grid": grid}})

    def image(self, topic: str) -> str:
        return self._add("Image", topic, {"imageMode": {"imageTopic": topic}})

    def plot(self, topic: str, paths: list[str]) -> str:
        lines = [{"value": path, "enabled": True, "timestampMethod": "receiveTime"} for path in paths]
        config = {"paths": lines, "xAxisVal": "timestamp", "showLegend": True, "isSynced": True}
        return self._add("Plot", topic, config)

    def tabs(self, tabs: list[tuple[str, str]]) -> str:
        shown = [{"title": topic, "layout": panel} for topic, panel in tabs]
        return self._add("Tab", "plots", {"activeTabIdx": 0, "tabs": shown})

    def source(self) -> str:
        return self._add("SourceInfo", "log", {})

    def _add(self, kind: str, name: str, config: dict[str, Any]) -> str:
        panel = f"{kind}!{name.strip('/').replace('/', '_')}"
        self.by_id[panel] = config
        return panel


def _split(direction: str, parts: list[Any]) -> Any:
    """Arrange parts beside (row) or under (column) each other, of equal size; Foxglove splits in two."""
    if len(parts) == 1:
        return parts[0]
    fraction = round(100 / len(parts))
    return {
        "direction": direction, "first": parts[0], "second": _split(direction, parts[1:]), "splitPercentage": fraction
    }  # fmt: skip


def _lines(log: LogFile, topic: str, schema: str) -> list[str]:
    """Return Foxglove's message paths of the numbers that change in a topic; none if there are none."""
    if schema == _JOINTS:
        positions = [name for name in log.table(topic).columns if name.endswith(".position_rad")]
        return [f"{topic}.joints[{i}].position" for i in range(len(positions))][:MAX_LINES]
    if schema.startswith("foxglove."):
        return []
    table = log.table(topic)
    return [
        f"{topic}.{name}"
        for name, column in table.items()
        if name != "t_s" and "." not in str(name) and pd.api.types.is_numeric_dtype(column) and column.nunique() > 1
    ][:MAX_LINES]
