"""Aim of a motion by words: the outcome of each rollout as a person sees it, where nobody measures a miss."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass

from kendama_cli.adaptation.aim import Aim, AimPath, aimed, predicted

CAUGHT = "caught"
SIDES: dict[str, tuple[int, int]] = {"short": (0, -1), "long": (0, 1), "right": (1, -1), "left": (1, 1)}
"""Axis and sign of the miss as seen along the flight of the ball, x, and to its left, y."""
GRADES_M = {"little": 0.035, "": 0.09, "much": 0.18}
"""Steps of the aim where outcomes have grades: below 60 mm beside the cup's axis, between, above 150 mm."""
TURNED = 0.6
"""Factor on a graded step after a change of side."""
PLAIN_M, PLAIN_GROWTH, PLAIN_MAX_M, PLAIN_TURNED = 0.06, 1.5, 0.15, 0.5
"""Steps where outcomes have no grade: the first, its growth while the side stays, its bound, its factor after a change.
"""
ALLOWED = "caught, short, long, left or right; with little or much where you can tell, as in 'little short'"


@dataclass(frozen=True)
class Outcome:
    """Outcome of a rollout: ``side`` is CAUGHT or one of SIDES, ``grade`` one of GRADES_M."""

    side: str
    grade: str = ""

    @property
    def caught(self) -> bool:
        """True if the ball was caught."""
        return self.side == CAUGHT

    @property
    def text(self) -> str:
        """Words that ``read_outcome`` reads."""
        return f"{self.grade} {self.side}".strip()


def read_outcome(text: str) -> Outcome | None:
    """Return the outcome that ``text`` tells, None where it is none of ALLOWED."""
    words = text.lower().split()
    sides = [one for one in words if one in SIDES or one == CAUGHT]
    grades = [one for one in words if one in GRADES_M]
    if len(sides) != 1 or len(grades) > 1 or len(words) != 1 + len(grades) or (grades and sides == [CAUGHT]):
        return None
    return Outcome(sides[0], *grades)


def next_aim_by_words(path: AimPath, rollouts: Sequence[tuple[Aim, Outcome]]) -> Aim:
    """Return the aim of the next rollout: the newest one moved against the side on which its ball came down.

    After a catch it is the same once more.
    """
    if not rollouts:
        return Aim(path.first_m)
    last, outcome = rollouts[-1]
    if outcome.caught:
        return last
    axis, sign = SIDES[outcome.side]
    told = [one for _, one in rollouts if not one.caught and SIDES[one.side][0] == axis]
    desired = list(predicted(path, last))
    desired[axis] -= path.forward * sign * step_m(told)
    x, y = desired
    return aimed(path, path.clipped(x) if axis == 0 else last.along_m, (x, y))


def step_m(told: Sequence[Outcome]) -> float:
    """Return the size [m] of the step after the last of the misses ``told``, all along one axis."""
    turned = len(told) > 1 and told[-2].side != told[-1].side
    if any(one.grade for one in told):
        return GRADES_M[told[-1].grade] * (TURNED if turned else 1.0)
    size_m = PLAIN_M
    for before, after in itertools.pairwise(told):
        size_m = size_m * PLAIN_TURNED if before.side != after.side else min(size_m * PLAIN_GROWTH, PLAIN_MAX_M)
    return size_m
