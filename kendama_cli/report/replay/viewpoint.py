"""The direction from which a replay is seen at first: where the arm hides cup and ball least."""

from __future__ import annotations

import math

import numpy as np

from kendama_cli.report.replay.performance import Performance

USUAL_RAD = math.atan2(0.9, 0.34)
"""Azimuth, from x about z: across the swing's plane, a little from its front."""
OTHERS_RAD = tuple(math.radians(step) for step in (0, -15, 15, -30, 30, -45, 45))
RISE = 0.27
"""Slope of the view downward."""
LINK_RADIUS_M = 0.09
FRAMES, POINTS = 60, 6
"""So many frames are looked at, and so many points of each link."""


def azimuth_rad(performances: list[Performance]) -> float:
    """Return the azimuth on either side of the swing's plane from which links hide cup and ball in the fewest frames.

    Of equal ones the usual side and the smallest turn from it are taken; without an arm it is the usual one.
    """
    armed = [one for one in performances if one.links is not None]
    sides = [USUAL_RAD + turn for turn in OTHERS_RAD] + [-USUAL_RAD + turn for turn in OTHERS_RAD]
    return min(sides, key=lambda azimuth: sum(_hidden(one, azimuth) for one in armed))


def _hidden(one: Performance, azimuth: float) -> int:
    """Return in how many frames a link stands between the viewer and the cup or the ball, counted for each."""
    assert one.links is not None
    count = min(len(one.links.poses), len(one.bodies.poses))
    chosen = np.unique(np.linspace(0, count - 1, FRAMES).astype(int))
    ends = one.links.poses[chosen, :, :3]
    along = np.linspace(0.0, 1.0, POINTS)[:, None]
    links = (ends[:, :-1, None] * (1 - along) + ends[:, 1:, None] * along).reshape(len(chosen), -1, 3)
    view = np.array([math.cos(azimuth), math.sin(azimuth), RISE])
    view /= np.linalg.norm(view)
    hidden = 0
    for name in ("cup", "ball"):
        away = links - one.bodies.poses[chosen, one.bodies.names.index(name), None, :3]
        toward = away @ view
        beside = np.linalg.norm(away - toward[..., None] * view, axis=-1)
        hidden += int(((beside < LINK_RADIUS_M) & (toward > LINK_RADIUS_M)).any(axis=1).sum())
    return hidden
