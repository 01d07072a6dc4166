"""State bins: a plain state becomes one row of the table."""

from __future__ import annotations

import math
from bisect import bisect_right

from kendama_cli.learning.settings import GridSettings
from kendama_cli.learning.state import SwingState


class StateGrid:
    """Tiles position x velocity x angle x rate; every finite state falls into exactly one cell.

    A cell holds its lower edge but not its upper one. The angle's bins are equal and the first is centred on 0. A
    *mirrored* grid bins |x| and turns left and right about where x < 0: the swing is symmetric, so that what is learned
    on one side holds on the other, and the table still distinguishes whether cup and ball move outward or inward.
    """

    def __init__(self, settings: GridSettings) -> None:
        self.mirrored = settings.position == "mirrored"
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
        place = self.place(state) % self.n_states
        bins = []
        for n in reversed(self.shape):
            place, bin_ = divmod(place, n)
            bins.append(bin_)
        return tuple(reversed(bins))

    def row(self, state: SwingState) -> int:
        """The row of the table, 0..n_states-1, counted with the last coordinate fastest."""
        return self.place(state) % self.n_states

    def place(self, state: SwingState) -> int:
        """The row, plus ``n_states`` where left and right were turned about: what a decision depends on."""
        x_m, velocity_m_s, angle_rad, rate_rad_s = state
        place = 0
        if self.mirrored and x_m < 0.0:
            x_m, velocity_m_s, angle_rad, rate_rad_s = -x_m, -velocity_m_s, -angle_rad, -rate_rad_s
            place = self.shape[0]
        place += bisect_right(self._position, abs(x_m) if self._distance else x_m)
        place = place * self.shape[1] + bisect_right(self._velocity, velocity_m_s)
        place = place * self._angles + math.floor(angle_rad * self._per_rad + 0.5) % self._angles
        return place * self.shape[3] + bisect_right(self._rate, rate_rad_s)
