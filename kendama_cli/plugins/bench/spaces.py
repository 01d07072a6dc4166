"""Spaces of others as tiles and levels: any Box or Discrete observation, any Box or Discrete action."""

from __future__ import annotations

from typing import Any

import gymnasium
import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from kendama_cli.errors import ConfigError

Numbers = NDArray[np.float64]
_UNBOUNDED = 1e3
"""A bound beyond this is none: nobody means tiles over it."""
_MARGIN = 0.1
"""A range that was seen is widened by this fraction of it, to either side."""


class Levels:
    """Actions as a grid of levels: of a Box ``levels`` in each dimension, of a Discrete its own in their order."""

    def __init__(self, space: gymnasium.Space[Any], levels: int) -> None:
        """Raise ConfigError for another space."""
        self._discrete = isinstance(space, spaces.Discrete)
        self.shape: tuple[int, ...]
        if isinstance(space, spaces.Discrete):
            self._start, self.shape = int(space.start), (int(space.n),)
        elif isinstance(space, spaces.Box) and np.isfinite([space.low, space.high]).all():
            self.shape = (levels,) * space.low.size
            steps = np.linspace(0.0, 1.0, levels)[:, None]
            self._values = space.low.ravel() + steps * (space.high - space.low).ravel()
            self._of, self._dtype = space.shape, space.dtype
        else:
            raise ConfigError("environment", f"its actions are {space}; allowed: Discrete, or a Box with bounds")
        self.n = int(np.prod(self.shape))

    def action(self, index: int) -> Any:
        """Return the action of a column of the table."""
        if self._discrete:
            return self._start + index
        places = np.unravel_index(index, self.shape)
        return np.array([self._values[place, i] for i, place in enumerate(places)], self._dtype).reshape(self._of)

    def nearest(self, wanted: Numbers) -> int:
        """Return the column nearest to ``wanted`` (dimensions,), each from -1 to 1."""
        highest = np.array(self.shape) - 1
        places = np.rint(0.5 * (np.clip(wanted, -1.0, 1.0) + 1.0) * highest).astype(int)
        return int(np.ravel_multi_index(tuple(places), self.shape))


def flat(observation: Any) -> Numbers:
    """Return an observation as numbers (n,)."""
    return np.asarray(observation, dtype=np.float64).reshape(-1)


def bounds(space: gymnasium.Space[Any]) -> tuple[Numbers, Numbers]:
    """Return the lowest and highest observation (n,), NaN where the space has no bound.

    Raises ConfigError for another space.
    """
    if isinstance(space, spaces.Discrete):
        return np.array([float(space.start)]), np.array([float(space.start + space.n - 1)])
    if not isinstance(space, spaces.Box):
        raise ConfigError("environment", f"its observations are {space}; allowed: Box or Discrete")
    low, high = flat(space.low), flat(space.high)
    known = (np.abs(low) < _UNBOUNDED) & (np.abs(high) < _UNBOUNDED)
    return np.where(known, low, np.nan), np.where(known, high, np.nan)


def widened(low: Numbers, high: Numbers, seen: Numbers) -> tuple[Numbers, Numbers]:
    """Return ``low`` and ``high`` with the range of what was ``seen`` (m, n) where they are NaN."""
    least, most = seen.min(axis=0), seen.max(axis=0)
    margin = _MARGIN * np.maximum(most - least, 1e-6)
    return np.where(np.isnan(low), least - margin, low), np.where(np.isnan(high), most + margin, high)
