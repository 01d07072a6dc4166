"""Faults of a film's frames and their times, reported before work on it begins."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from kendama_cli.devices.camera.film import Film
from kendama_cli.schema.arrays import Array

COUNTED = (".avi", ".mp4", ".m4v", ".mov")
"""Containers that count their frames; others estimate them from duration and rate."""
ROUNDED = 2
"""Frames by which a count from the durations in an edit list may be off."""
EVEN = 1.5
"""Frames are evenly spaced where the widest gap is less than so many times the median one."""


def shown_otherwise(film: Film) -> Iterator[str]:
    """Yield a line about each way in which a film's metadata has it shown otherwise than it was taken."""
    if film.turned_deg:
        lines = "run upwards" if film.turned_deg == 180 else "are columns"
        yield (
            f"{film.path}: it is turned by {film.turned_deg}° as its metadata says, to {film.width_px} x "
            f"{film.height_px} px: only a calibration by films turned alike fits, and a rolling shutter's lines {lines}"
        )
    if film.is_mirrored:
        yield f"{film.path}: its metadata mirrors it, which is left out: places are as the lens saw them"


def film_faults(film: Film, times_s: Array) -> Iterator[str]:
    """Yield a line about each fault of a film of which the frames at ``times_s`` (n,) can be read."""
    yield from shown_otherwise(film)
    frames, declared, expected = len(times_s), film.declared, film.expected
    if trimmed := expected < declared - ROUNDED:
        yield f"{film.path}: it is trimmed: its edit list shows about {expected} of its {declared} frames"
    if film.avi is not None and film.avi.damaged_byte is not None:
        yield (
            f"{film.path}: it is damaged at byte {film.avi.damaged_byte}, after {frames} of its {declared} frames; an "
            "AVI does not say when a frame was taken, so what follows is left out"
        )
    elif film.path.suffix.lower() in COUNTED and frames < (expected - ROUNDED if trimmed else declared):
        yield f"{film.path}: {frames} of its {expected} frames can be read: it is cut off or damaged; copy it again"
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
