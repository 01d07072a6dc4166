"""A motion to render."""

from __future__ import annotations

import numpy as np

from kendama_cli.report.replay.performance import Frames, Performance
from kendama_cli.schema.foxglove import Solid

STILL = (1.0, 0.0, 0.0, 0.0)


def example_motion(seconds: float, catch_s: float | None = None) -> Performance:
    """A ball that passes from left to right over a cup beside a box."""
    n = round(100 * seconds) + 1
    poses = np.zeros((n, 2, 7))
    poses[:, :, 3] = 1.0
    poses[:, :, 2] = 1.2
    poses[:, 1, 0] = np.linspace(0.3, -0.3, n)  # world x runs to the left in a view from +y
    poses[:, 1, 2] = 1.35
    links = np.tile([0.0, -0.6, 0.6, *STILL], (n, 1, 1))
    solids = (Solid("post", "pedestal", "box", (0.3, 0.3, 0.3), (0.2, 0.2, 1.2)),)
    bodies, arm = Frames(("cup", "ball"), 0.0, 100.0, poses), Frames(("post",), 0.0, 100.0, links)
    return Performance("made up", "simulation", bodies, arm, solids, rope_m=0.4, rim_m=0.07, catch_s=catch_s)
