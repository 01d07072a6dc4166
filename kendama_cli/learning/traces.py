"""Eligibility traces: which earlier choices share in what happens now (PAPER.md eq. 7).

Every law first fades all traces by gamma lambda, then marks the visited entry: *replacing* sets it to 1 (Singh and
Sutton 1996; the paper's choice), *accumulating* adds 1, *dutch* adds 1 after shrinking it by 1 - alpha (van Seijen
and Sutton 2014).
"""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import NDArray

Traces = Literal["replacing", "accumulating", "dutch"]


def visited(
    traces: NDArray[np.float64], row: int, column: int, *, law: Traces, fading: float, alpha: float
) -> NDArray[np.float64]:
    """The traces (states, actions) after a visit of (row, column), with ``fading`` = gamma lambda."""
    faded = traces * fading
    if law == "replacing":
        faded[row, column] = 1.0
    elif law == "accumulating":
        faded[row, column] += 1.0
    else:
        faded[row, column] += 1.0 - alpha * faded[row, column]
    return faded
