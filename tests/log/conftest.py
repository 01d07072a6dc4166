"""Logs to write and read back."""

from pathlib import Path

import numpy as np
import pytest

from kendama_cli.log.writer import McapLog


def filled(n: int = 300) -> McapLog:
    """A log with four topics of different kinds, ``n`` instants each, the larger part random."""
    rng = np.random.default_rng(3)
    log = McapLog()
    for step in range(n):
        t_s = 0.01 * step
        x, y, z = rng.standard_normal(3)
        log.write("/adapt/cup", t_s, {"parent": "world", "child": "cup", "position_m": (x, y, z)})
        joints = {"names": ["a", "b"], "position_rad": [x, y], "velocity_rad_s": [y, z]}
        log.write("/adapt/joints", t_s, joints)
        log.write("/adapt/repeat", t_s, {"index": step, "caught": step % 3 == 0, "miss_m": z})
    log.write("/learn/table", 0.0, {"rollout": 0, "rows": 2, "columns": 2, "values": [0.0, 1.0, 2.0, 3.0]})
    return log


@pytest.fixture
def log_file(tmp_path: Path) -> Path:
    path = tmp_path / "log.mcap"
    filled().finish(path, stage="adapt", settings={"a": {"b": 1.5}}, metrics={"caught": True})
    return path
