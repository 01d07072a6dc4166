"""Recordings as files of many kinds, and settings to read them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import yaml

from kendama_cli.devices.demonstrator.file import open_files
from kendama_cli.devices.demonstrator.settings import FileCapture
from kendama_cli.schema.arrays import Array
from kendama_cli.schema.settings import build

CONF = Path(__file__).parents[3] / "conf" / "capture"


def file_settings(path: Any, name: str = "file", **changes: Any) -> FileCapture:
    """conf/capture/<name>.yaml over file.yaml for ``path`` (one or a list); nested groups are changed key by key."""
    data, own = (yaml.safe_load((CONF / f"{one}.yaml").read_text()) for one in ("file", name))
    paths = [str(one) for one in path] if isinstance(path, (list, tuple)) else str(path)
    for key, value in (*own.items(), *changes.items(), ("path", paths)):
        data[key] = {**data[key], **value} if isinstance(value, dict) else value
    return build(FileCapture, data, "capture")


def swing(count: int = 201, rate_hz: float = 100.0) -> tuple[Array, Array]:
    """Times (n,) and positions (n, 3) of a smooth swing of 0.3 m within two seconds."""
    t = np.arange(count) / rate_hz
    u = np.clip(t / 2.0, 0, 1)
    x = 0.15 * np.sin(2 * np.pi * u) * np.sin(np.pi * u)
    return t, np.column_stack((x, 0.01 * np.sin(np.pi * u) ** 2, 0.1 * np.sin(3 * np.pi * u) * np.sin(np.pi * u)))


def csv_lines(scale: float = 1.0) -> list[str]:
    """The swing as lines of CSV with a header; positions are metres times ``scale``."""
    t, p = swing()
    rows = [f"{a:.3f},{x:.6f},{y:.6f},{z:.6f}" for a, (x, y, z) in zip(t, scale * p, strict=True)]
    return ["t_s,x_m,y_m,z_m", *rows]


def write(path: Path, lines: list[str]) -> Path:
    path.write_text("\n".join(lines) + "\n")
    return path


def read(path: Any, name: str = "file", **changes: Any) -> tuple[Array, Array]:
    """Times and positions of the one recording in ``path``."""
    (hand,) = open_files(file_settings(path, name, **changes))
    samples = list(hand.samples())
    return np.array([s.t_s for s in samples]), np.array([s.position_m for s in samples])
