"""Which axes of a source are ours: x in the swing's plane, y, and z up."""

from __future__ import annotations

from typing import Literal

from kendama_cli.errors import ConfigError

Axis = Literal["x", "-x", "y", "-y", "z", "-z"]
Axes = tuple[Axis, Axis, Axis]
"""Which axis of the source is our x, y and z: [x, -z, y] where its y points up."""


def check_axes(axes: Axes) -> None:
    """Raise ConfigError where an axis occurs twice, or where they mirror the space."""
    if sorted(axis[-1] for axis in axes) != ["x", "y", "z"]:
        raise ConfigError("axes", f"'axes' is {list(axes)}; allowed: each of x, y and z once, with its sign")
    order = [axis[-1] for axis in axes]
    odd = (order[0] > order[1]) ^ (order[0] > order[2]) ^ (order[1] > order[2])
    if (sum(axis.startswith("-") for axis in axes) % 2 == 1) != odd:
        raise ConfigError(
            "axes",
            f"'axes' is {list(axes)}, which mirrors the space: a right-handed frame becomes left-handed; turn "
            f"one axis round, such as [{', '.join([_turned(axes[0]), *axes[1:]])}]",
        )


def to_ours(axes: Axes) -> tuple[tuple[float, ...], ...]:
    """The rows of the rotation from the source's axes to ours."""
    return tuple(tuple((-1.0 if axis.startswith("-") else 1.0) * (axis[-1] == one) for one in "xyz") for axis in axes)


def _turned(axis: str) -> str:
    return axis[1:] if axis.startswith("-") else f"-{axis}"
