"""SARSA(lambda) on tiles of any Box or Discrete space; they are stored when visited."""

from __future__ import annotations

from typing import Any, Literal

import gymnasium
import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from kendama_cli.errors import ConfigError
from kendama_cli.learning.updates import ahead

_UNBOUNDED = 1e3
"""A bound beyond this is none: nobody means tiles over it."""
_MARGIN = 0.1
"""A range that was seen is widened by this fraction of it, to either side."""
Numbers = NDArray[np.float64]
Rows = NDArray[np.int64]
_FADED = 1e-3
"""A trace below this is dropped."""


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


class Tiling:
    """Tiles of observations: tiling k of n is offset by (k (2 j + 1) mod n) / n of a tile along dimension j."""

    def __init__(self, low: Numbers, high: Numbers, tiles: int, tilings: int) -> None:
        self.low, self.high = low, high
        self._per_unit = tiles / np.maximum(high - low, 1e-9)
        steps = np.arange(tilings)[:, None] * (2 * np.arange(len(low)) + 1)
        self._offsets, self._last = (steps % tilings) / tilings, tiles
        self._numbers = np.arange(tilings)[:, None]
        self.places: dict[bytes, int] = {}

    def rows(self, numbers: Numbers, *, grow: bool) -> Rows:
        """Return the row of each tiling's tile, -1 where it was never visited and may not ``grow``."""
        found = np.floor((numbers - self.low) * self._per_unit + self._offsets)
        found = np.clip(found, 0, self._last).astype(np.int16)
        keys = np.hstack([self._numbers.astype(np.int16), found])
        if grow:
            return np.array([self.places.setdefault(key.tobytes(), len(self.places)) for key in keys])
        return np.array([self.places.get(key.tobytes(), -1) for key in keys])


class TileTable:
    """Values (rows, actions), a sum over the tilings, and replacing traces on those of this episode."""

    def __init__(self, n_actions: int, *, gamma: float, trace_decay: float, update: Literal["sarsa", "q"]) -> None:
        self._q = np.zeros((1024, n_actions))
        self._traces = np.zeros(self._q.size)
        self._active = np.empty(0, np.int64)
        self._columns, self._gamma, self._fading, self._update = n_actions, gamma, gamma * trace_decay, update

    def values(self, rows: Rows) -> Numbers:
        """Return the values of the actions where these tiles are active; a tile without a row counts 0."""
        known = rows[rows >= 0]
        while len(known) and known.max() >= len(self._q):
            self._q = np.vstack([self._q, np.zeros_like(self._q)])
            self._traces = np.concatenate([self._traces, np.zeros_like(self._traces)])
        return np.asarray(self._q[known].sum(axis=0))

    def begin(self) -> None:
        """Forget all traces."""
        self._traces[self._active] = 0.0
        self._active = np.empty(0, np.int64)

    def update(
        self, rows: Rows, column: int, reward: float, following: tuple[Numbers, int] | None, alpha: float
    ) -> None:
        """Learn from one transition; ``following`` are the next values and choice, None where the episode ended."""
        there = 0.0 if following is None else ahead(self._update, following[0][None], 0, following[1])
        used = rows * self._columns + column
        flat = self._q.reshape(-1)
        error = reward + self._gamma * there - float(flat[used].sum())
        self._traces[self._active] *= self._fading
        self._active = np.concatenate([self._active, used[self._traces[used] == 0.0]])
        self._traces[used] = 1.0
        flat[self._active] += alpha / len(rows) * error * self._traces[self._active]
        faded = self._traces[self._active] < _FADED
        if faded.any():
            self._traces[self._active[faded]] = 0.0
            self._active = self._active[~faded]

    @property
    def stored(self) -> Numbers:
        """A copy of the values (rows, actions)."""
        return np.array(self._q)

    def restore(self, values: Numbers) -> None:
        """Take ``values`` instead."""
        self._q = np.array(values)
        self._traces, self._active = np.zeros(self._q.size), np.empty(0, np.int64)
