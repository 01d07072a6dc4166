"""Swings with known formulas, and settings, for the tests of motion."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from kendama_cli.artifacts.demonstration import Demonstration
from kendama_cli.motion.dmp.settings import EncodeSettings
from kendama_cli.schema.arrays import Array
from kendama_cli.schema.settings import build

CONF = Path(__file__).parents[2] / "conf"


def settings(name: str = "dmp", **changes: Any) -> EncodeSettings:
    """conf/encode/<name>.yaml with some values changed."""
    made = build(EncodeSettings, yaml.safe_load((CONF / "encode" / f"{name}.yaml").read_text()), "encode")
    return dataclasses.replace(made, **changes)


def smooth_step(u: Array) -> Array:
    """Minimum jerk from 0 to 1 while u goes from 0 to 1."""
    u = np.clip(u, 0.0, 1.0)
    return u**3 * (10 - 15 * u + 6 * u**2)


def path(t: Array, duration: float = 2.0) -> Array:
    """A swing (n, 3) of 0.25 m that rests at both ends, in a world where it starts away from the origin."""
    u = t / duration
    x = 0.25 * smooth_step((u - 0.1) / 0.4) - 0.2 * smooth_step((u - 0.45) / 0.45)
    y = 0.02 * smooth_step((u - 0.2) / 0.6)
    z = 0.15 * smooth_step((u - 0.15) / 0.3) - 0.1 * smooth_step((u - 0.5) / 0.35)
    return np.column_stack((x, y, z)) + np.array([0.5, -0.2, 0.8])


def demonstration(
    duration: float = 2.0, rate_hz: float = 100.0, *, name: str = "swing", head_s: float = 0.0, tail_s: float = 0.0
) -> Demonstration:
    """The swing of ``path``, resting ``head_s`` before and ``tail_s`` after."""
    t = np.arange(round((head_s + duration + tail_s) * rate_hz) + 1) / rate_hz
    return Demonstration(name, t, path(t - head_s, duration))
