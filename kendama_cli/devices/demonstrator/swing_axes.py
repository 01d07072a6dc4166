"""Doubts whether z points up and x lies in the swing's plane, by what a ball on a rope does under the hand's path.

The path alone does not tell which way is up. A ball does: under a person's swing it rises over the cup and comes down
near it, under the same path turned it does not. So a recording is refused only where it is a swing under another
reading of its axes and none as declared; one mirrored or turned about z is a swing as good as its image, and adapt
searches in its own plane.
"""

from __future__ import annotations

import math

import numpy as np

from kendama_cli.devices.demonstrator.hanging_ball import rise_of
from kendama_cli.devices.demonstrator.recording import Recording
from kendama_cli.errors import InputError
from kendama_cli.schema.arrays import Array

UP = ("z", "-z", "y", "-y", "x", "-x")
DIRECTIONS = np.array([(0, 0, 1), (0, 0, -1), (0, 1, 0), (0, -1, 0), (1, 0, 0), (-1, 0, 0)], dtype=np.float64)

SURE_RISE, SURE_CATCH = 0.9, 0.25
"""A swing: the ball rises with nearly every rope and tempo, and comes down near the cup with a quarter of them."""
DOUBTFUL_RISE, DOUBTFUL_CATCH = 0.65, 0.2
"""No swing: below these both. Between them nothing is said."""
NEVER_RISES = 0.1

LONGEST_S = 8.0
"""Longer recordings hold more than a swing; nothing is said of them."""
SIDEWAYS_RATIO = 2.0
LEAST_SIDEWAYS_M = 0.03
TURNED_RAD = math.radians(8)
"""A plane turned by 8 degrees shortens x by 1 %, which moves a ball's miss by 40 mm."""


def check_axes(recording: Recording, strictness: str) -> list[str]:
    """Return doubts about the declared axes; raises InputError if ``strictness`` is ``refuse`` and they are certain."""
    if strictness == "off" or recording.t_s[-1] - recording.t_s[0] > LONGEST_S:
        return []
    doubt, certain = _doubt(recording.t_s, recording.position_m)
    if not doubt:
        return []
    if certain and strictness == "refuse":
        raise InputError(
            recording.path,
            doubt,
            remedy=f"{recording.axes_remedy}; if they are right, capture.plausible.axes=warn",
        )
    return [f"{doubt}; {recording.axes_remedy}"]


def _doubt(t_s: Array, place_m: Array) -> tuple[str, bool]:
    """Return a sentence about the axes, empty if there is no doubt, and True if it is certain."""
    (own,) = rise_of(t_s, place_m, DIRECTIONS[:1])
    if own.rising <= DOUBTFUL_RISE and own.caught <= DOUBTFUL_CATCH:
        others = rise_of(t_s, place_m, DIRECTIONS[1:])
        best = max(range(len(others)), key=lambda i: (others[i].caught, others[i].rising))
        if others[best].rising >= SURE_RISE and others[best].caught >= SURE_CATCH:
            up = UP[1 + best]
            return (
                f"z does not seem to point up: with {up} upward a ball on a rope rises over the cup and falls near "
                f"it, as declared it rises for {own.rising:.0%} of the ropes and tempos only",
                True,
            )
        if own.rising <= NEVER_RISES:
            return (
                f"with this motion a ball on a rope of 0.32 to 0.42 m never rises over the cup{_rate(t_s, place_m)}",
                False,
            )
    flat = place_m[:, :2] - place_m[:, :2].mean(axis=0)
    sizes, axes = np.linalg.eigh(flat.T @ flat / len(flat))
    widest = math.sqrt(max(float(sizes[1]), 0.0))
    heading = math.atan2(abs(float(axes[1, 1])), abs(float(axes[0, 1])))
    if widest < LEAST_SIDEWAYS_M or heading < TURNED_RAD:
        return "", False
    ratio = widest / max(math.sqrt(max(float(sizes[0]), 0.0)), 1e-9)
    if ratio > SIDEWAYS_RATIO:
        return f"the swing's plane is turned by {math.degrees(heading):.0f} deg from x: so will the arm's be", False
    return "", False


def _rate(t_s: Array, place_m: Array) -> str:
    """Return what to say of the rate: a swing whose times are half or twice as long as they were is none."""
    for factor, told in ((0.5, "half as long: recorded at twice the rate?"), (2.0, "twice as long: at half the rate?")):
        (other,) = rise_of(factor * t_s, place_m, DIRECTIONS[:1])
        if other.rising >= SURE_RISE and other.caught >= SURE_CATCH:
            return f", but it does with times {told}"
    return ""
