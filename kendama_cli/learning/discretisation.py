"""State bins: a plain state becomes one row of the table."""

from __future__ import annotations

import math
from bisect import bisect_right

from kendama_cli.learning.state import SwingState
from kendama_cli.settings.learn import GridSettings


class StateGrid:
    """Tiles position x velocity x angle x rate; every finite state falls into exactly one cell.

    A cell holds its lower edge but not its upper one. The angle's bins are equal and the first is centred on 0.
    """

    def __init__(self, settings: GridSettings) -> None:
        self._distance = settings.position == "distance"
        self._position = settings.position_edges_m
        self._velocity = settings.velocity_edges_m_s
        self._rate = settings.rate_edges_rad_s
        self._angles = settings.angle_bins
        self._per_rad = settings.angle_bins / (2.0 * math.pi)
        self.shape = (
            len(self._position) + 1,
            len(self._velocity) + 1,
            self._angles,
            len(self._rate) + 1,
        )
        self.n_states = math.prod(self.shape)

    def cell(self, state: SwingState) -> tuple[int, ...]:
        """The bin of each coordinate, in the order of ``shape``."""
        x_m, velocity_m_s, angle_rad, rate_rad_s = state
        return (
            bisect_right(self._position, abs(x_m) if self._distance else x_m),
            bisect_right(self._velocity, velocity_m_s),
            math.floor(angle_rad * self._per_rad + 0.5) % self._angles,
            bisect_right(self._rate, rate_rad_s),
        )

    def row(self, state: SwingState) -> int:
        """The row of the table, 0..n_states-1, counted with the last coordinate fastest."""
        x_m, velocity_m_s, angle_rad, rate_rad_s = state
        row = bisect_right(self._position, abs(x_m) if self._distance else x_m)
        row = row * self.shape[1] + bisect_right(self._velocity, velocity_m_s)
        row = row * self._angles + math.floor(angle_rad * self._per_rad + 0.5) % self._angles
        return row * self.shape[3] + bisect_right(self._rate, rate_rad_s)
