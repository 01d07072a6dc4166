"""Result of bench: a policy on tiles, with all that is needed to act by it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from kendama_cli.schema.arrays import Array, array


@dataclass(frozen=True)
class TilePolicy:
    """Policy of the best sum of values of the active tiles.

    ``low`` and ``high`` (n,) are the tiled range, ``keys`` (rows, 1 + n) number and place of each tile, ``values``
    (rows, actions) what is summed.
    """

    environment: str
    tiles: int
    tilings: int
    action_levels: int
    low: Array
    high: Array
    keys: Array
    values: Array

    def __post_init__(self) -> None:
        for name, shape in {"low": (None,), "high": (None,), "keys": (None, None), "values": (None, None)}.items():
            object.__setattr__(self, name, array(name, getattr(self, name), shape))
        if len(self.keys) != len(self.values) or self.keys.shape[1] != 1 + len(self.low):
            raise ValueError(f"keys {self.keys.shape} and values {self.values.shape} must have a row for each tile")

    @staticmethod
    def as_keys(places: dict[bytes, int]) -> Array:
        """Return the keys of ``places``, in the order of their rows."""
        ordered = sorted(places, key=places.__getitem__)
        return np.array([np.frombuffer(key, np.int16) for key in ordered], dtype=np.float64)
