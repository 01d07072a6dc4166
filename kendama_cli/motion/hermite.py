"""The cubic through two states."""

from __future__ import annotations

import numpy as np

from kendama_cli.schema.arrays import Array

State = tuple[Array, Array]
"""Places and speeds (n,)."""


def cubic_between(first: State, last: State, *, steps: int, step_s: float) -> tuple[Array, Array, Array]:
    """Return positions, velocities and accelerations (``steps``, n) at the end of every step from ``first`` to
    ``last``.

    q(t) = q0 + t (v0 + t (c + t d)), where c and d are such that q and q' are those of ``last`` after all steps.
    """
    (q0, v0), (q1, v1), total = first, last, steps * step_s
    c = (3 * (q1 - q0) / total - 2 * v0 - v1) / total
    d = (v0 + v1 - 2 * (q1 - q0) / total) / total**2
    t = step_s * np.arange(1, steps + 1)[:, None]
    return q0 + t * (v0 + t * (c + t * d)), v0 + t * (2 * c + 3 * t * d), 2 * c + 6 * t * d
