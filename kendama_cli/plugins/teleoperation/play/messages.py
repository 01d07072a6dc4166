"""Messages of the page, checked word by word: it is a browser, and anybody can write to a socket."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from kendama_cli.errors import UsageError
from kendama_cli.plugins.teleoperation.play.conditions import Conditions
from kendama_cli.plugins.teleoperation.play.table import HandSample

LONGEST = 65536
"""Bytes of a message; a second of a 1000 Hz mouse takes half of it."""
MOST_SAMPLES = 1000
FARTHEST = 1e3
"""No coordinate of a hand is beyond this, in m or rad."""


@dataclass(frozen=True)
class Hand:
    """Samples of the hand, whether it holds the cup, and whether the page only guesses that it stands still."""

    samples: Sequence[HandSample]
    held: bool
    guessed: bool = False


@dataclass(frozen=True)
class Ease:
    """Play under these conditions."""

    conditions: Conditions


@dataclass(frozen=True)
class About:
    """Do something with a kept try: rename (``value`` is the new name), choose (yes or no), delete or show it."""

    action: str
    name: str
    value: str = ""


ACTIONS = ("rename", "choose", "delete", "show")


def parse(text: str | bytes) -> Hand | Ease | About:
    """Parse the message in ``text``; raises UsageError with its error."""
    try:
        data = json.loads(text)
    except (ValueError, RecursionError):
        raise UsageError("a message of the page is not JSON") from None
    if not isinstance(data, dict):
        raise UsageError("a message of the page is no object")
    kind = data.get("type")
    if kind == "hand":
        return Hand(_samples(data.get("samples")), data.get("held") is True, data.get("guessed") is True)
    if kind == "ease":
        return Ease(Conditions(*(_number(data, name) for name in ("gravity", "rope", "cup"))))
    if kind in ACTIONS:
        name, value = data.get("name"), data.get("value", "")
        if isinstance(name, str) and isinstance(value, str):
            return About(kind, name, value)
        raise UsageError(f"'{kind}' needs the name of a try")
    raise UsageError(
        f"a message of the page is of the kind {str(kind)[:20]!r}; allowed: hand, ease, {', '.join(ACTIONS)}"
    )


def _samples(rows: Any) -> list[HandSample]:
    if not isinstance(rows, list) or not 1 <= len(rows) <= MOST_SAMPLES:
        raise UsageError(f"the hand's samples are no list of 1 to {MOST_SAMPLES}")
    samples = []
    for row in rows:
        if not isinstance(row, list) or len(row) != 4 or not all(_is_number(value) for value in row):
            raise UsageError("a sample of the hand is not four finite numbers: time [ms], aside, up [m], tilt [rad]")
        t_ms, aside_m, up_m, tilt_rad = map(float, row)
        if max(abs(aside_m), abs(up_m), abs(tilt_rad)) > FARTHEST:
            raise UsageError(f"a sample of the hand is beyond {FARTHEST:g} m")
        samples.append(HandSample(t_ms / 1000, aside_m, up_m, tilt_rad))
    return samples


def _number(data: dict[str, Any], name: str) -> float:
    value = data.get(name)
    if not _is_number(value):
        raise UsageError(f"'{name}' is not a finite number")
    assert isinstance(value, int | float)
    return float(value)


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and abs(value) < 1e15 and math.isfinite(value)
