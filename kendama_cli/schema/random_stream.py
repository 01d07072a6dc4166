"""The one random stream of a name: what resumed runs and repeated trials rest on."""

from __future__ import annotations

import zlib

import numpy as np


def random_stream(seed: int, name: str, *numbers: int) -> np.random.Generator:
    """Return the random generator of ``name`` under ``seed``, and of the ``numbers`` under it."""
    return np.random.default_rng([seed, zlib.crc32(name.encode()), *numbers])
