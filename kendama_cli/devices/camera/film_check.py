"""What is wrong with a film's frames and their times, to be told before work on it begins."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from kendama_cli.devices.camera.film import Film
from kendama_cli.schema.arrays import Array

COUNTED = (".avi", ".mp4", ".m4v", ".mov")
"""Containers that count their frames; others estimate them from duration and rate."""
EVEN = 1.5
"""Frames are evenly spaced where the widest gap is less than so many times the median one."""


def film_faults(film: Film, times_s: Array) -> Iterator[str]:
    """A line about each fault of a film of which the frames at ``times_s`` (n,) can be read."""
    frames, declared = len(times_s), film.declared
    if film.avi is not None and film.avi.damaged_byte is not None:
        yield (
            f"{film.path}: it is damaged at byte {film.avi.damaged_byte}, after {frames} of its {declared} frames; an "
            "AVI does not say when a frame was taken, so what follows is left out"
        )
    elif film.path.suffix.lower() in COUNTED and frames < declared:
        yield f"{film.path}: {frames} of its {declared} frames can be read: it is cut off or damaged; copy it again"
    gaps_s = np.diff(times_s)
    if not len(gaps_s):
        return
    usual_s, widest_s = float(np.median(gaps_s)), float(gaps_s.max())
    if widest_s > EVEN * usual_s:
        uneven = int(np.count_nonzero(gaps_s > EVEN * usual_s))
        yield (
            f"{film.path}: its frames are not evenly spaced ({1e3 * usual_s:.3g} ms, but {uneven} gaps of up to "
            f"{1e3 * widest_s:.3g} ms): each has its own time, but the ball may be lost in the gaps"
        )
