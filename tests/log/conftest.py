"""Logs to write and read back."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from kendama_cli.log.writer import McapLog
from kendama_cli.schema.foxglove import FrameTransform, JointStates
from kendama_cli.stages.adapt.messages import AdaptRepeatMessage
from kendama_cli.stages.learn.messages import QTableMessage
from tests.log.made_logs import memory_log


def messages(n: int) -> Iterator[tuple[str, float, object]]:
    """Four topics of different kinds, ``n`` instants each, the larger part random."""
    rng = np.random.default_rng(3)
    for step in range(n):
        t_s = 0.01 * step
        x, y, z = rng.standard_normal(3)
        yield "/adapt/cup", t_s, FrameTransform("world", "cup", (x, y, z))
        yield "/adapt/joints", t_s, JointStates(["a", "b"], position_rad=[x, y], velocity_rad_s=[y, z])
        yield "/adapt/repeat", t_s, AdaptRepeatMessage(index=step, caught=step % 3 == 0, miss_m=z)
    yield "/learn/table", 0.0, QTableMessage(rollout=0, rows=2, columns=2, values=[0.0, 1.0, 2.0, 3.0])


def filled(n: int = 300) -> McapLog:
    """A log of ``messages(n)``."""
    log = memory_log()
    for topic, t_s, message in messages(n):
        log.write(topic, t_s, message)
    return log


@pytest.fixture
def log_file(tmp_path: Path) -> Path:
    path = tmp_path / "log.mcap"
    filled().finish(path, stage="adapt", settings={"a": {"b": 1.5}}, metrics={"caught": True})
    return path
