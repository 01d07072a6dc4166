"""A rectangle of an image."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray


@dataclass(frozen=True)
class Region:
    """Columns ``left <= u < right`` and rows ``top <= v < bottom`` of an image [px]."""

    left: int
    top: int
    right: int
    bottom: int

    @property
    def empty(self) -> bool:
        """Return True if no pixel lies inside."""
        return self.right <= self.left or self.bottom <= self.top

    @property
    def corners(self) -> NDArray[np.int64]:
        """Left, top, right and bottom, as compiled code takes them."""
        return np.array([self.left, self.top, self.right, self.bottom], dtype=np.int64)

    def within(self, other: Region) -> Region:
        """Return the part of this region that lies in ``other``; it may be empty."""
        return Region(
            max(self.left, other.left),
            max(self.top, other.top),
            min(self.right, other.right),
            min(self.bottom, other.bottom),
        )


def around(centre_px: ArrayLike, half_px: ArrayLike) -> Region:
    """Return the region of ``half_px`` (scalar or (2,)) to every side of ``centre_px`` (2,)."""
    low = np.floor(np.asarray(centre_px) - np.asarray(half_px)).astype(int)
    high = np.ceil(np.asarray(centre_px) + np.asarray(half_px)).astype(int) + 1
    return Region(int(low[0]), int(low[1]), int(high[0]), int(high[1]))


def whole(width_px: int, height_px: int) -> Region:
    """Return the region of a whole image."""
    return Region(0, 0, width_px, height_px)
