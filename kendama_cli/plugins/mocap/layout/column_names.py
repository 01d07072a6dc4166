"""Quantities that the names of a table's columns tell: times, places by axis, parts of quaternions."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Literal

from kendama_cli.schema.units import METRES, SECONDS, LengthUnit, TimeUnit, length_unit, time_unit

Kind = Literal["time", "place", "turn", "other"]
TIMES = frozenset({"t", "time", "times", "timestamp", "timestamps", "stamp", "zeit", "seconds", "clock", "date"})
COUNTERS = frozenset({"frame", "frames", "index", "idx", "sample", "no", "nr", "row", "#", "id", "field"})
TURNS = frozenset({"q", "quat", "quaternion", "rot", "rotation", "orientation", "ori", "orient"})
PLACES = frozenset({"p", "pos", "position", "t", "trans", "translation", "loc", "location", "coord", "coordinate"})
_MOTIONS = {"v", "vel", "velocity", "speed", "a", "acc", "accel", "acceleration", "lin", "linear", "force", "torque"}
_ANGLES = {"ang", "angle", "angles", "angular", "omega", "gyro", "mag", "euler", "roll", "pitch", "yaw"}
_DOUBTS = {"error", "residual", "sigma", "std", "cov", "confidence", "action", "cmd", "pixel", "pixels"}
OTHERS = frozenset(_MOTIONS | _ANGLES | _DOUBTS | {f"{what}{axis}" for what in "rvawfgm" for axis in "xyz"})
_OTHER_UNIT = re.compile(
    r"[numkM\N{MICRO SIGN}]?(V|A|Ah|W|J|N|Nm|Pa|G|T|g|Hz|F|dB\w*|lx|bar|K|C|bit)|.*(/|%|\N{DEGREE SIGN}|\^).*"
    r"|deg\w*|rad\w*|celsius|min\w*|hours?|days?|bool\w*|a\.?u\.?|counts?|px|pixels?|rpm|bpm"
)
"""Units of what is no place: of currents, angles, fractions, rates."""
_BRACKETS = re.compile(r"[\[({]([^\])}]*)[\])}]")
_WORDS = re.compile(r"[A-Z]+(?![a-z])|[A-Z]?[a-z]+|\d+|#|\N{MICRO SIGN}s")


@dataclass(frozen=True)
class Named:
    """Meaning of a column's name: its quantity, axis (w, x, y, z), the words that name its body, and its unit."""

    kind: Kind
    axis: str = ""
    body: str = ""
    length: LengthUnit | None = None
    time: TimeUnit | None = None
    excluded: bool = False
    """its words or its unit say that it is no place, no time and no orientation"""


def named(label: str, unit_cell: str = "") -> Named:
    """Return what ``label`` means; ``unit_cell`` is the cell of a row of units below it, where there is one."""
    inner = [*_BRACKETS.findall(label), unit_cell] if unit_cell else _BRACKETS.findall(label)
    words = [word.lower() for word in _WORDS.findall(_BRACKETS.sub(" ", label))]
    told = [word for word in words[1:] if word in METRES or word in SECONDS] if len(words) > 1 else []
    length = next((metric for word in (*inner, *told) if (metric := length_unit(word))), None)
    time = next((span for word in (*inner, *told) if (span := time_unit(word))), None)
    strange = any(cell.strip() and length_unit(cell) is None and cell.strip(" -1") for cell in inner)
    rest = [word for word in words if word not in told or word == "in"]
    if TIMES & set(words) and not any(word in "xyz" for word in words):
        return Named("time", time=time or _glued_time(label))
    if OTHERS & set(rest) or ("px" in rest and set("xyz") & set(rest)):  # x_px: pixels; px alone: a position
        return Named("other", excluded=True)
    axis, rest = _axis(rest)
    if not axis:
        measured = any(_OTHER_UNIT.fullmatch(cell.strip()) for cell in inner) and length is None
        return Named("time", time=time) if time and not rest else Named("other", excluded=measured)
    body = " ".join(word for word in rest if word not in TURNS | PLACES)
    if axis == "w" or TURNS & set(rest):
        return Named("turn", axis, body)
    return Named("other", excluded=True) if strange and length is None else Named("place", axis, body, length)


def _glued_time(label: str) -> TimeUnit | None:
    """Return the unit at the end of a name such as ``time_ms`` or ``timestampNs``."""
    end = _WORDS.findall(label)[-1].lower()
    return time_unit(end) if end not in TIMES or end == "seconds" else None


def _axis(words: list[str]) -> tuple[str, list[str]]:
    """Return the axis among ``words`` (alone, or in one such as ``qx`` and ``posz``), and the other words."""
    alone = [i for i, word in enumerate(words) if word in ("w", "x", "y", "z")]
    if alone:
        return words[alone[-1]], words[: alone[-1]] + words[alone[-1] + 1 :]
    for i, word in enumerate(words):
        begin, end = word[:-1], word[-1:]
        if end in ("w", "x", "y", "z") and begin in TURNS | PLACES:
            return end, [*words[:i], begin, *words[i + 1 :]]
        if begin and word[0] in "xyz" and word[1:] in PLACES:
            return word[0], [*words[:i], word[1:], *words[i + 1 :]]
    return "", words
