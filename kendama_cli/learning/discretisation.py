"""State bins: a plain state becomes one row of the table."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

from kendama_cli.learning.settings import GridSettings
from kendama_cli.learning.state import SwingState


class Bins(NamedTuple):
    """Bins of a state: rising edges of position, velocity and rate, in sequences or arrays, and equal ones of angle."""

    distance: bool
    mirrored: bool
    position: Any
    velocity: Any
    rate: Any
    angles: int
    per_rad: float


class StateGrid:
    """Tiles position x velocity x angle x rate; every finite state falls into exactly one cell.

    A cell holds its lower edge but not its upper one. The angle's bins are equal and the first is centred on 0. A
    *mirrored* grid bins |x| and mirrors left and right where x < 0: the swing is symmetric, so that what is learned
    on one side holds on the other, and the table still distinguishes whether cup and ball move outward or inward.
    """

    def __init__(self, settings: GridSettings) -> None:
        self.bins = bins = Bins(
            distance=settings.position == "distance",
            mirrored=settings.position == "mirrored",
            position=settings.position_edges_m,
            velocity=settings.velocity_edges_m_s,
            rate=settings.rate_edges_rad_s,
            angles=settings.angle_bins,
            per_rad=settings.angle_bins / (2.0 * math.pi),
        )
        self.mirrored = bins.mirrored
        self.shape = len(bins.position) + 1, len(bins.velocity) + 1, bins.angles, len(bins.rate) + 1
        self.n_states = math.prod(self.shape)

    def cell(self, state: SwingState) -> tuple[int, ...]:
        """Return the bin of each coordinate, in the order of ``shape``."""
        index = self.place(state) % self.n_states
        bins = []
        for n in reversed(self.shape):
            index, bin_ = divmod(index, n)
            bins.append(bin_)
        return tuple(reversed(bins))

    def row(self, state: SwingState) -> int:
        """Return the row of the table, 0..n_states-1, counted with the last coordinate fastest."""
        return self.place(state) % self.n_states

    def place(self, state: SwingState) -> int:
        """Return the row, plus ``n_states`` where left and right were turned about: what a decision depends on."""
        return place_of(self.bins, *state)


def place_of(bins: Bins, x_m: float, velocity_m_s: float, angle_rad: float, rate_rad_s: float) -> int:
    """Return the row of a state, see StateGrid.place."""
    index = 0
    if bins.mirrored and x_m < 0.0:
        x_m, velocity_m_s, angle_rad, rate_rad_s = -x_m, -velocity_m_s, -angle_rad, -rate_rad_s
        index = len(bins.position) + 1
    index += _bin(bins.position, abs(x_m) if bins.distance else x_m)
    index = index * (len(bins.velocity) + 1) + _bin(bins.velocity, velocity_m_s)
    index = index * bins.angles + math.floor(angle_rad * bins.per_rad + 0.5) % bins.angles
    return int(index * (len(bins.rate) + 1) + _bin(bins.rate, rate_rad_s))


def _bin(edges: Any, value: float) -> int:
    n = 0
    while n < len(edges) and edges[n] <= value:
        n += 1
    return n
