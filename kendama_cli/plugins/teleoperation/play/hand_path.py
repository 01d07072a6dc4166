"""Path of the cup from the hand's samples, in steps of the simulation."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from kendama_cli.schema.arrays import Array
from kendama_cli.simulation.dart.world import STEP_S


@dataclass(frozen=True)
class PathState:
    """All that a HandPath remembers at one moment."""

    t_s: float
    last: Array
    steps: int
    recent: Array


class HandPath:
    """Joins samples that come at any rate, and smooths them, in the order of time and without looking ahead.

    Samples are joined by lines, taken at every STEP_S and averaged twice over ``smoothing_s``, which turns the
    corners at the samples into smooth curves and the grid of a screen's pixels into noise of a tenth of a millimetre:

        cup(t) = sum_j w_j hand(t - j STEP_S),   w = box * box

    The weights are symmetric, so that the cup follows the hand by ``delay_s`` whatever the motion; what remains beside
    it is a / 2 times the variance of the weights (0.1 mm at 20 m/s^2).
    """

    def __init__(self, smoothing_s: float, start: Array) -> None:
        """Start at ``start`` (m,), the hand's position at time 0 and before."""
        box = np.ones(round(smoothing_s / STEP_S) + 1)
        self._weights = np.convolve(box, box) / len(box) ** 2
        self.delay_s = (len(box) - 1) * STEP_S
        self._t_s, self._last = 0.0, np.array(start, dtype=np.float64)
        self._steps = 0
        self._recent = np.tile(self._last, (len(self._weights) - 1, 1))

    @property
    def t_s(self) -> float:
        """The time of the last sample [s]."""
        return self._t_s

    def follow(self, samples: Sequence[tuple[float, Array]]) -> Array:
        """Return the cup's positions (n, m) up to the last of ``samples``: times [s] not falling, positions (m,).

        A sample that is older than the last one counts as one of its time.
        """
        t_s = np.maximum.accumulate([self._t_s, *(t_s for t_s, _ in samples)])
        hand = np.array([self._last, *(place for _, place in samples)])
        steps = np.arange(self._steps + 1, int(t_s[-1] / STEP_S + 1e-6) + 1)
        joined = np.column_stack([np.interp(steps * STEP_S, t_s, column) for column in hand.T])
        known = np.concatenate([self._recent, joined])
        self._t_s, self._last, self._steps = float(t_s[-1]), hand[-1], self._steps + len(steps)
        kept = len(self._weights) - 1
        self._recent = known[len(known) - kept :]
        if len(steps) == 0:  # numpy would take the shorter of path and weights for the weights
            return joined
        return np.column_stack([np.convolve(column, self._weights, "valid") for column in known.T])

    def moment(self) -> PathState:
        """Return the present state, to which ``go_back`` can return."""
        return PathState(self._t_s, self._last, self._steps, self._recent)

    def go_back(self, to: PathState) -> None:
        """Forget the samples since that moment."""
        self._t_s, self._last, self._steps, self._recent = to.t_s, to.last, to.steps, to.recent
