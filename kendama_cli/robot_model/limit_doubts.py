"""Doubts about the limits that a file gives for an arm's joints.

Of the standard library only: the command line asks them before a run, in which numpy may not be needed at all.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

MOST_RANGE_RAD = 4.05 * math.pi
"""Over two turns: arms that turn without end are told as continuous joints."""
MOST_SPEED_RAD_S = 50.0
FEWEST = 3
"""Joints of which one round number on all is a placeholder rather than a coincidence."""
UNLIMITED_RAD = 999.0


def doubts_of(
    names: Sequence[str],
    limits: Mapping[str, tuple[float, ...]],
    friction: Mapping[str, tuple[float, ...]],
    sources: Mapping[str, str],
) -> list[str]:
    """Return what is doubtful about ``limits`` and ``friction`` (see Description), a sentence for all joints alike."""
    found = []
    ranges = [upper - lower for lower, upper in zip(limits["lower_rad"], limits["upper_rad"], strict=False)]
    wide = [name for name, extent in zip(names, ranges, strict=False) if MOST_RANGE_RAD < extent < 2 * UNLIMITED_RAD]
    fast = [name for name, top in zip(names, limits["velocity_rad_s"], strict=False) if top > MOST_SPEED_RAD_S]
    told = [f"more than two turns in {', '.join(wide)}"] if wide else []
    told += [f"more than {MOST_SPEED_RAD_S:g} rad/s in {', '.join(fast)}"] if fast else []
    if told:
        found.append(f"limits may be degrees, or placeholders: {'; '.join(told)} (a URDF's are in rad and rad/s)")
    found += [
        f"may be a placeholder: {placeholder}"
        for key in ("velocity_rad_s", "effort_nm")
        if (placeholder := placeholder_in(key, limits[key], sources[key]))
    ]
    columns = (names, friction["coulomb_nm"], friction["viscous_nm_s"], limits["velocity_rad_s"], limits["effort_nm"])
    heavy = [name for name, dry, viscous, top, maximum in zip(*columns, strict=False) if dry + viscous * top > maximum]
    if heavy:
        found.append(f"friction at top speed is beyond the effort limit: {', '.join(heavy)}")
    return found


def placeholder_in(key: str, values: tuple[float, ...], source: str) -> str:
    """Return in words that the file gives one round number for all joints; an empty text where it does not."""
    same = len(values) >= FEWEST and len(set(values)) == 1 and values[0] > 0
    if not same or source.startswith("robot."):
        return ""
    digits = f"{values[0]:.6e}".partition("e")[0].rstrip("0").rstrip(".")
    return (
        f"{source} is {values[0]:g} for all {len(values)} joints; robot.{key} gives others" if len(digits) == 1 else ""
    )
