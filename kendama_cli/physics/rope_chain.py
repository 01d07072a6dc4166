"""The rope as a chain of links with mass: where its links end, what they weigh, and how they lie round the cup."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from kendama_cli.physics.rope import CupProfile, pivot
from kendama_cli.schema.arrays import Array
from kendama_cli.settings.game import CupSettings, HandleTie

SAME_M = 1e-6
"""Edges of the cup that are nearer to each other along the rope are one."""


def link_lengths_m(rope_m: float, edges_m: Sequence[float], links: int) -> list[float]:
    """Split a rope into ``links``, with an end where it goes over each edge of the cup, ``edges_m`` along the rope.

    A taut rope lies over an edge always with the same place. A link across an edge would cut its corner.
    """
    ends = np.unique([0.0, *(edge for edge in edges_m if edge < rope_m), rope_m])
    gaps = np.diff(ends[np.insert(np.diff(ends) > SAME_M, 0, True)])
    pieces = np.ones(len(gaps), dtype=int)
    while pieces.sum() < links:
        pieces[np.argmax(gaps / pieces)] += 1
    return np.repeat(gaps / pieces, pieces).tolist()


def node_masses_kg(rope_kg: float, lengths_m: Sequence[float]) -> Array:
    """Return the masses at the ends (n + 1,) of n links: half of each link beside them."""
    half = 0.5 * rope_kg / sum(lengths_m) * np.asarray(lengths_m)
    return np.asarray(np.append(0.0, half) + np.append(half, 0.0))


def cup_sections_m(cup: CupSettings) -> Array:
    """Return the rectangles (k, 4) whose rotation about the axis is the cup: min. and max. distance and height.

    Floor, wall, and the handle where there is one.
    """
    r, floor, rim = cup.outer_radius_m, cup.floor_m, cup.rim_m
    sections = [(-r, r, floor, floor + cup.wall_m), (cup.radius_m, r, floor, rim)]
    if isinstance(cup.tie, HandleTie):
        sections.append((-cup.tie.radius_m, cup.tie.radius_m, 0.0, floor))
    return np.array(sections)


def laid(profile: CupProfile, lengths_m: Sequence[float], ball_m: Array, axis: Array) -> Array:
    """Lay the ends (n + 1, 3) of n links from the tie on the shortest way to ``ball_m`` (3,) round the cup.

    ``axis`` (3,) is the cup's. Where the way is shorter than the rope all links are, where it is longer the last one.
    """
    above = float(ball_m @ axis)
    lateral = ball_m - above * axis
    across = float(np.linalg.norm(lateral))
    side = lateral / across if across > 0.0 else np.cross([0.0, 1.0, 0.0], axis)
    _, _, used = pivot(profile, across, above)
    bends = [(0.0, 0.0)]
    corners = (profile.handle_m, 0.0), (profile.radius_m, profile.floor_m), (profile.radius_m, profile.rim_m)
    bends += [corner for corner, path in zip(corners, profile.used_m, strict=True) if 0.0 < path <= used]
    bends.append((across, above))
    points = np.array(bends)
    ends = np.append(0.0, np.cumsum(np.hypot(*np.diff(points, axis=0).T)))
    at = np.append(0.0, np.cumsum(lengths_m)) * min(1.0, ends[-1] / math.fsum(lengths_m))
    at[-1] = ends[-1]  # the last link is the rope's spring
    out, up = np.interp(at, ends, points[:, 0]), np.interp(at, ends, points[:, 1])
    return np.outer(out, side) + np.outer(up, axis)
