"""Axes and signs from a source's frame to ours (x in the swing's plane, y, z up), and their effect on rotations."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Literal

from kendama_cli.errors import ConfigError

Axis = Literal["x", "-x", "y", "-y", "z", "-z"]
Axes = tuple[Axis, Axis, Axis]
"""Which axis of the source is our x, y and z: [x, -z, y] where its y points up."""
Handedness = Literal["right", "left"]
HANDEDNESS = "Handedness of the axes in which the file gives its orientations; Unity's are left-handed."


def to_ours(axes: Axes) -> tuple[tuple[float, ...], ...]:
    """Return the rows of the matrix from the source's axes to ours; raises ConfigError where an axis occurs twice."""
    if sorted(axis[-1] for axis in axes) != ["x", "y", "z"]:
        raise ConfigError("axes", f"'axes' is {list(axes)}; allowed: each of x, y and z once, with its sign")
    return tuple(tuple((-1.0 if axis.startswith("-") else 1.0) * (axis[-1] == one) for one in "xyz") for axis in axes)


def determinant(axes: Axes) -> int:
    """Return the determinant of that matrix: -1 where it mirrors the space."""
    order = parity([axis[-1] for axis in axes]) or 1
    return -order if sum(axis.startswith("-") for axis in axes) % 2 else order


def mirror_problem(determinant: int, handedness: Handedness) -> str:
    """Return what is wrong with a map of orientations by its determinant, and what to do; empty where nothing is.

    Ours are right-handed, so the map has to mirror the orientations of a left-handed source and no others.
    """
    if (determinant < 0) == (handedness == "left"):
        return ""
    if determinant < 0:
        return (
            "mirrors the space and its orientations: a right-handed frame becomes left-handed; turn one axis round, or "
            "set capture.handedness=left if the source's axes are left-handed"
        )
    return "leaves left-handed axes left-handed (capture.handedness=left); turn one axis round"


def parity(columns: Sequence[int | str | None]) -> int | None:
    """Return 1 or -1 for an even or odd order of the columns of x, y and z; None where it is not known.

    By the axis in their names, such as ``qx``, ``pose.position.x`` or ``X1``, else by the order in the file, which is
    taken to be x, y, z.
    """
    positions = [_axis_of(column) if isinstance(column, str) else column for column in columns]
    known = [position for position in positions if position is not None]
    if len(set(known)) < 3 or len({type(column) for column in columns}) > 1:
        return None
    x, y, z = known
    return -1 if (x > y) ^ (x > z) ^ (y > z) else 1


def _axis_of(name: str) -> int | None:
    """Return the axis 0, 1 or 2 in a column's name."""
    words = [word.lower() for word in re.split(r"[^A-Za-z]+|(?<=[a-z])(?=[A-Z])", name) if word]
    alone = [word for word in words if word in ("x", "y", "z")]
    short = [word[-1] for word in words if len(word) == 2 and word[-1] in "xyz"]
    found = (alone or short or [words[-1][-1:]] if words else [""])[-1]
    return "xyz".find(found) if found in ("x", "y", "z") else None
