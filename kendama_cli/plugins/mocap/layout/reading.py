"""One way of reading a recording: which track of it, at which times, in which unit."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from kendama_cli.schema.arrays import Array

AxisMap = Sequence[tuple[int, int]]
"""For each of our axes, the index of the source's axis and its sign."""
CUPS = frozenset(
    {"cup", "ken", "kendama", "tool", "hand", "wrist", "gripper", "effector", "ee", "tcp", "flange", "stylus"}
)
BALLS = frozenset({"ball", "tama", "bob", "object"})


@dataclass(frozen=True)
class Finding:
    """One guess: what it is about, its value, and the evidence for it."""

    about: str
    value: str
    evidence: str


@dataclass(frozen=True)
class Reading:
    """``t_s`` (n,) and ``place_m`` (n, 3) under one hypothesis, along the source's axes named ``axes``.

    ``settings`` returns what the YAML says for a choice of axes. Readings of a smaller ``rank`` are preferred where
    both are swings: the body whose name says that it is the cup.
    """

    track: str
    t_s: Array
    place_m: Array
    axes: tuple[str, str, str]
    findings: tuple[Finding, ...]
    settings: Callable[[AxisMap], Mapping[str, Any]]
    rank: float = 1
    strict: bool = False
    """a swing only where the checks would be sure of it, as the rate is a guess too"""
    guessed: str = ""
    """the unit or rate, where it is no more than a guess"""


def rank_of(name: str) -> int:
    """Return 0 for a name of the cup or the hand, 2 for one of a ball, 1 for any other."""
    words = set("".join(one if one.isalpha() else " " for one in name.lower()).split())
    return 2 if words & BALLS else 0 if words & CUPS else 1
