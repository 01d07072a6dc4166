"""Commands that are lost on their way to an arm, in bursts."""

from __future__ import annotations

import numpy as np

from kendama_cli.schema.arrays import Array


class CommandLoss:
    """Loss of the ``fraction`` of commands, ``burst`` in a row on average, sampled from ``rng``.

    A channel of two states (E. N. Gilbert, Bell System Technical Journal 39, 1960): from bad to good with 1 / burst,
    from good to bad with fraction / (burst (1 - fraction)). The first command arrives.
    """

    def __init__(self, fraction: float, burst: float, steps: int, rng: np.random.Generator) -> None:
        """Count ``steps`` steps a command."""
        self._rng, self._steps, self._ends = rng, steps, 1.0 / burst
        self._begins = fraction / (burst * (1.0 - fraction))
        self._count, self._bad = 0, False
        self._last: Array = np.zeros(0)

    def arrived(self, position: Array, velocity: Array, acceleration: Array) -> tuple[Array, Array, Array]:
        """Return the reference (n,) for the next step: what is sent, or the last position, at rest."""
        if self._count and self._count % self._steps == 0:
            self._bad ^= bool(self._rng.random() < (self._ends if self._bad else self._begins))
        self._count += 1
        if self._bad:
            rest = np.zeros_like(self._last)
            return self._last, rest, rest
        self._last = position
        return position, velocity, acceleration
