"""Units of length and time, as settings and programs write them, counts in words, and a unit quaternion's length."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Literal

LengthUnit = Literal["m", "cm", "mm", "in"]
TimeUnit = Literal["s", "ms", "us", "ns"]
METRES: Mapping[LengthUnit, float] = {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "in": 0.0254}
SECONDS: Mapping[TimeUnit, float] = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}
_LENGTHS: Mapping[str, LengthUnit] = {"meter": "m", "metre": "m", "centimet": "cm", "millimet": "mm", "inch": "in"}
_TIMES: Mapping[str, TimeUnit] = {
    "sec": "s",
    "millisec": "ms",
    "msec": "ms",
    "microsec": "us",
    "usec": "us",
    "nanosec": "ns",
    "nsec": "ns",
    "\N{MICRO SIGN}s": "us",
    "\N{GREEK SMALL LETTER MU}s": "us",
}
"""Units by how their written names begin."""


def count_of(number: int, what: str) -> str:
    """Return ``number`` and ``what`` it counts, plural but for one: ``1 file``, ``2 files``."""
    return f"{number} {what}{'' if number == 1 else 's'}"


class Counted(int):
    """A number that ``{n:swing}`` shows with what it counts: ``1 swing``, ``2 swings``."""

    def __format__(self, spec: str) -> str:
        return count_of(self, spec) if len(spec) > 1 and spec.isalpha() else int.__format__(self, spec)


def length_unit(word: str) -> LengthUnit | None:
    """Return the unit of length that ``word`` means, such as ``[mm]`` or ``Millimeters``; None for any other."""
    plain = _plain(word)
    begun = (unit for begin, unit in _LENGTHS.items() if plain.startswith(begin))
    return next((unit for unit in METRES if plain == unit), next(begun, None))


def time_unit(word: str) -> TimeUnit | None:
    """Return the unit of time that ``word`` means, such as ``(s)`` or ``Seconds``; None for any other."""
    plain = _plain(word)
    begun = (unit for begin, unit in _TIMES.items() if plain.startswith(begin))
    return next((unit for unit in SECONDS if plain == unit), next(begun, None))


def _plain(word: str) -> str:
    return word.strip(" \t\0[](){}").lower()


UNIT_SLACK = 1e-2
"""Recorded and written quaternions are rounded; a length farther from 1 means that the numbers are something else."""
