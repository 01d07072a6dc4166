"""Shapes and surfaces of cup and ball in MuJoCo: the cup's collide with the ball's, and with nothing else."""

from __future__ import annotations

import math
from typing import Any

from scipy.optimize import brentq

from kendama_cli.settings.game import CupSettings, HandleTie

RIGID = 0.9999
"""Impedance of the ball's contact, the most that MuJoCo has: its force is that of spring and damper alone."""


def add_cup(mj: Any, carried: Any, cup: CupSettings) -> None:
    """Add the staves and floor of the cup to the body ``carried`` as DART has them, and its handle."""
    solid = {"contype": 1, "conaffinity": 0, "condim": 1, "mass": 0.0}
    width, out = cup.outer_radius_m * math.tan(math.pi / cup.staves), cup.radius_m + cup.wall_m / 2
    middle = cup.floor_m + cup.depth_m / 2
    for stave in range(cup.staves):
        angle = 2 * math.pi * stave / cup.staves
        carried.add_geom(
            type=mj.mjtGeom.mjGEOM_BOX,
            size=[cup.wall_m / 2, width, cup.depth_m / 2],
            pos=[out * math.cos(angle), out * math.sin(angle), middle],
            quat=[math.cos(angle / 2), 0, 0, math.sin(angle / 2)],
            **solid,
        )
    floor = [cup.radius_m, cup.wall_m / 2, 0]
    carried.add_geom(type=mj.mjtGeom.mjGEOM_CYLINDER, size=floor, pos=[0, 0, cup.floor_m + cup.wall_m / 2], **solid)
    if isinstance(cup.tie, HandleTie):
        stick = [cup.tie.radius_m, cup.tie.length_m / 2, 0]
        carried.add_geom(type=mj.mjtGeom.mjGEOM_CYLINDER, size=stick, pos=[0, 0, cup.tie.length_m / 2], **solid)


def ball_surface(friction: float, restitution: float, contact_s: float) -> dict[str, Any]:
    """Return the options of the ball's geom: it meets the cup alone, by a spring and damper that only push.

    ``contact_s`` is the inverse of the undamped rate of that spring [s]; a few steps of the simulation at least.
    """
    spring, damper = 1.0 / contact_s**2, 2.0 * damping_ratio(restitution) / contact_s
    return {
        "contype": 0,
        "conaffinity": 1,
        "condim": 3,
        "priority": 1,
        "friction": [friction, 0, 0],
        "solref": [-spring, -damper],
        "solimp": [RIGID, RIGID, 0.001, 0.5, 2.0],
    }


def damping_ratio(restitution: float) -> float:
    """Return the ratio of a spring and damper that only push a ball away, with ``restitution`` of its velocity.

    Schwager and Poeschel 2007 (https://doi.org/10.1007/s10035-007-0065-z): the contact ends when its force does, not
    when the ball is where it was met.
    """
    return float(brentq(lambda ratio: _log_restitution(ratio) - math.log(max(restitution, 1e-3)), 0.0, 100.0))


def _log_restitution(ratio: float) -> float:
    if abs(ratio - 1.0) < 1e-9:
        return -2.0
    if ratio < 1.0:
        return -2.0 * ratio * math.acos(ratio) / math.sqrt(1.0 - ratio**2)
    return -2.0 * ratio * math.acosh(ratio) / math.sqrt(ratio**2 - 1.0)
