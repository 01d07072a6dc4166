"""Shape checks that every artifact runs on construction."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]


def array(name: str, value: ArrayLike, shape: tuple[int | None, ...], *, finite: bool = True) -> Array:
    """``value`` as a read-only float64 array of ``shape`` (None: any length).

    Raises ValueError that names the array where the shape differs or a value is not finite.
    """
    made = np.array(value, dtype=np.float64)
    if made.ndim != len(shape) or any(want not in (None, have) for want, have in zip(shape, made.shape, strict=True)):
        raise ValueError(f"{name} must have shape {shape}, not {made.shape}")
    if finite and not np.isfinite(made).all():
        raise ValueError(f"{name} holds a value that is not finite at {tuple(np.argwhere(~np.isfinite(made))[0])}")
    made.flags.writeable = False
    return made


def rising(name: str, value: ArrayLike) -> Array:
    """``value`` as a read-only vector that strictly rises; raises ValueError otherwise."""
    made = array(name, value, (None,))
    if (np.diff(made) <= 0).any():
        raise ValueError(f"{name} must rise strictly; it does not at index {int(np.argmax(np.diff(made) <= 0)) + 1}")
    return made
