"""Tile coding: the state falls into one tile of each of several offset tilings (Sutton and Barto, section 9.5.4)."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from kendama_cli.learning.learner_settings import TileCodingSettings
from kendama_cli.learning.settings import LearnSettings
from kendama_cli.learning.state import SwingState


class Tiles:
    """Tiles of cup place, cup velocity, ball angle and rate; ``n`` in all tilings together.

    Tiling k of n is offset by the share (k (2 j + 1) mod n) / n of a tile along coordinate j: odd steps spread the
    tiles evenly (Miller and Glanz). Places follow ``learn.grid.position``: x, its distance from the middle, or left and
    right turned about where x < 0. The angle goes round; beyond the other ranges the outermost tiles go on.
    """

    def __init__(self, settings: LearnSettings) -> None:
        own = settings.learner
        assert isinstance(own, TileCodingSettings)
        workspace = settings.workspace
        self._mirrored = settings.grid.position == "mirrored"
        self._distance = settings.grid.position == "distance"
        one_sided = self._mirrored or self._distance
        counts = np.array([own.position_tiles, own.velocity_tiles, own.angle_tiles, own.rate_tiles])
        half = np.array([workspace.half_width_m, workspace.max_speed_m_s, math.pi, own.fastest_rad_s])
        self._lowest = np.where([one_sided, False, False, False], 0.0, -half)
        self._per_unit = counts / (half - self._lowest)
        steps = np.arange(own.tilings)[:, None] * (2 * np.arange(4) + 1)
        self._offsets = (steps % own.tilings) / own.tilings
        self._last = counts  # an offset line takes one tile more than it is cut into
        self._angles = own.angle_tiles
        shape = np.where([True, True, False, True], counts + 1, counts)
        self._strides = np.array([math.prod(shape[j + 1 :].tolist()) for j in range(4)])
        one = math.prod(shape.tolist())
        self._first = np.arange(own.tilings) * one
        self.n = own.tilings * one

    def active(self, state: SwingState) -> NDArray[np.int64]:
        """The tile of each tiling (tilings,)."""
        numbers = np.array(state)
        if self._mirrored and state.x_m < 0.0:
            numbers = -numbers
        if self._distance:
            numbers[0] = abs(numbers[0])
        places = np.floor((numbers - self._lowest) * self._per_unit + self._offsets).astype(np.int64)
        angles = places[:, 2] % self._angles
        places = np.clip(places, 0, self._last)
        places[:, 2] = angles
        return np.asarray(places @ self._strides + self._first)
