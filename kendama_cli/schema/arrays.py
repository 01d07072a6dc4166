"""Shape checks that every artifact runs on construction."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from kendama_cli.schema.units import UNIT_SLACK

Array = NDArray[np.float64]


def array(name: str, value: ArrayLike, shape: tuple[int | None, ...], *, finite: bool = True) -> Array:
    """Return ``value`` as a read-only float64 array of ``shape`` (None: any length).

    Raises ValueError that names the array where the shape differs or a value is not finite.
    """
    made = np.array(value, dtype=np.float64)
    if made.ndim != len(shape) or any(want not in (None, have) for want, have in zip(shape, made.shape, strict=True)):
        raise ValueError(f"{name} must have shape {shape}, not {made.shape}")
    if finite and not np.isfinite(made).all():
        raise ValueError(f"{name} holds a value that is not finite at {tuple(np.argwhere(~np.isfinite(made))[0])}")
    made.flags.writeable = False
    return made


def set_arrays(record: object, **shapes: tuple[int | None, ...]) -> None:
    """Make the named fields of a frozen dataclass read-only arrays of these shapes; raises ValueError as ``array``."""
    for name, shape in shapes.items():
        object.__setattr__(record, name, array(name, getattr(record, name), shape))


class NotUnitError(ValueError):
    """A quaternion that is none of a rotation: its ``index`` among those given, and its ``length``."""

    def __init__(self, index: int, length: float) -> None:
        super().__init__(f"the length of the quaternion is {length:.4g}; it must be 1")
        self.index, self.length = index, length


def unit_quaternions(rotation_wxyz: ArrayLike) -> Array:
    """Return quaternions (4,) or (n, 4) made exactly of unit length; raises NotUnitError beyond UNIT_SLACK.

    What is of unit length but for rounding is left as it is, so that what was written is read again.
    """
    made = np.array(rotation_wxyz, dtype=np.float64)
    length = np.linalg.norm(made, axis=-1, keepdims=True)
    wrong = np.flatnonzero(~(np.abs(length - 1.0) <= UNIT_SLACK))
    if len(wrong):
        raise NotUnitError(int(wrong[0]), float(length.ravel()[wrong[0]]))
    return np.asarray(np.where(np.abs(length - 1.0) < 1e-12, made, made / length))


def rising(name: str, value: ArrayLike) -> Array:
    """Return ``value`` as a read-only vector that strictly rises; raises ValueError otherwise."""
    made = array(name, value, (None,))
    if (np.diff(made) <= 0).any():
        raise ValueError(f"{name} must rise strictly; it does not at index {int(np.argmax(np.diff(made) <= 0)) + 1}")
    return made
