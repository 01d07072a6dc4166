"""One recorded swing as it came from a file or a device."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from kendama_cli.errors import InputError
from kendama_cli.motion.rotation import inverse, multiply
from kendama_cli.schema.arrays import Array, NotUnitError, unit_quaternions

MIN_SAMPLES = 10
"""Fewer cannot show a swing."""

MAX_SAMPLES = 100_000
"""More than a minute at 1 kHz is a whole session, or a wrong time unit, and would be smoothed for minutes."""


@dataclass(frozen=True)
class Recording:
    """Samples of one demonstration: ``t_s`` (n,) from 0 and ``position_m`` (n, 3).

    ``where`` names a sample's position in the file (its line, its message), ``unit_remedy`` what to do
    about wrong units in files of this kind, ``axes_remedy`` where axes are declared.
    """

    path: str
    name: str
    t_s: Array
    position_m: Array
    where: Callable[[int], str]
    unit_remedy: str
    axes_remedy: str
    warnings: tuple[str, ...] = ()
    rotation_wxyz: Array | None = None
    """(n, 4) unit quaternions that turn the upright cup; None where only positions are recorded."""
    ball_m: Array | None = None
    """(n, 3) the ball, where it was recorded too; NaN where it was not seen."""
    origin: str = ""
    """one word of the file's head about who or what made the swing: ``# origin: synthetic``"""
    likely_error_m: float | None = None
    """root mean square error of the positions that the recording itself suggests; None where it does not tell"""

    def rows(self, chosen: NDArray[np.int64]) -> Recording:
        """Return the recording of the ``chosen`` samples alone, in their order, at their own times."""
        return replace(
            self,
            t_s=self.t_s[chosen],
            position_m=self.position_m[chosen],
            ball_m=None if self.ball_m is None else self.ball_m[chosen],
            rotation_wxyz=None if self.rotation_wxyz is None else self.rotation_wxyz[chosen],
            where=lambda sample: self.where(int(chosen[sample])),
        )


def unit_rotations(path: str, rotation_wxyz: Array, where: Callable[[int], str], *, from_start: bool) -> Array:
    """Normalise quaternions (n, 4) exactly and, ``from_start``, relative to an upright cup at the start.

    Raises InputError at the first that is of another length, for then the columns are something else.
    """
    try:
        unit = unit_quaternions(rotation_wxyz)
    except NotUnitError as wrong:
        raise InputError(
            path,
            f"a quaternion of length {wrong.length:.4g}; it must be 1",
            where=where(wrong.index),
            remedy="look at capture.rotation: w is the real part, some programs write it last",
        ) from None
    return multiply(unit, inverse(unit[0])) if from_start else unit
