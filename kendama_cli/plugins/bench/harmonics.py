"""Exploration by harmonics: one in each dimension of the action, for a whole episode."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

_FASTEST = 4.0
"""Shortest period of a harmonic, in actions."""


@dataclass(frozen=True)
class Harmonics:
    """amplitude cos(frequency k + phase) in each dimension, at action k of an episode; arrays (dimensions,)."""

    frequency: NDArray[np.float64]
    amplitude: NDArray[np.float64]
    phase: NDArray[np.float64]

    def at(self, k: int) -> NDArray[np.float64]:
        """Return the desired action, in fractions of its range."""
        return np.asarray(self.amplitude * np.cos(self.frequency * k + self.phase))

    @staticmethod
    def drawn(dimensions: int, longest: float, rng: Generator) -> Harmonics:
        """Sample periods from 4 actions to ``longest``, evenly on a logarithmic scale, and any phase."""
        slowest = math.log(max(longest, 2.0 * _FASTEST) / _FASTEST)
        period = _FASTEST * np.exp(slowest * rng.random(dimensions))
        amplitude, phase = 0.5 + rng.random(dimensions), 2.0 * math.pi * rng.random(dimensions)
        return Harmonics(2.0 * math.pi / period, amplitude, phase)

    def mutated(self, rng: Generator) -> Harmonics:
        """Return others near by: 5 % in frequency, 10 % in amplitude, 0.2 rad in phase (standard deviations)."""
        frequency, amplitude, phase = rng.standard_normal((3, len(self.phase)))
        return Harmonics(
            self.frequency * (1.0 + 0.05 * frequency),
            self.amplitude * (1.0 + 0.1 * amplitude),
            self.phase + 0.2 * phase,
        )
