"""Answers in words of a person who sees a ball come down beside the cup, some of them wrong."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from kendama_cli.adaptation.aim import Miss
from kendama_cli.adaptation.aim_words import GRADES_M, SIDES, Outcome

NEAR_M, FAR_M = 0.06, 0.15
"""Distances from the cup's axis between ``little``, no grade and ``much``."""
ALONG = ("short", "long")


def spoken(
    miss_m: Miss,
    forward: float,
    *,
    graded: bool,
    wrong: float = 0.0,
    sides: Sequence[str] = tuple(SIDES),
    rng: np.random.Generator,
) -> Outcome:
    """Return the answer to a miss of a ball that flew along x (``forward`` 1) or against it (-1).

    Each word, one of ``sides`` and if ``graded`` a grade, is drawn anew with probability ``wrong``: so a wrong one is
    at times right by chance.
    """
    apart_m = float(np.hypot(*miss_m))
    axis = int(abs(miss_m[1]) > abs(miss_m[0])) if set(sides) > set(ALONG) else 0
    seen = (axis, 1 if forward * miss_m[axis] > 0 else -1)
    side = next(name for name, where in SIDES.items() if where == seen)
    grade = ("little" if apart_m < NEAR_M else "much" if apart_m > FAR_M else "") if graded else ""
    if rng.random() < wrong:
        side = str(rng.choice(list(sides)))
    if graded and rng.random() < wrong:
        grade = str(rng.choice(list(GRADES_M)))
    return Outcome(side, grade)
