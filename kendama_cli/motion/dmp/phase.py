"""The phase of a movement primitive: what the forcing term reads instead of the clock (docs/equations.md eq. 4)."""

from __future__ import annotations

import numpy as np

from kendama_cli.schema.arrays import Array


def phase(share: Array, decay: float) -> Array:
    """x = exp(-alpha s), the solution of x' = -alpha x / tau with x(0) = 1 (docs/equations.md eq. 4).

    ``share`` s = t / tau (n,) is the part of the motion that has passed, ``decay`` is alpha. Returns (n,).
    """
    return np.exp(-decay * np.asarray(share, dtype=np.float64))
