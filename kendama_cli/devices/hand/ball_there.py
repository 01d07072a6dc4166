"""What the ball tells where it was recorded too: which way is down, and which swings ended in a catch."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from kendama_cli.devices.hand.recording import Recording
from kendama_cli.errors import InputError
from kendama_cli.schema.arrays import Array

REST_S = 0.15
LONGEST_M = 0.8
"""A ball farther from the cup than this does not hang from it."""
SHORTEST_M = 0.15
"""A ball nearer lies in the cup or the hand."""
STILL_M_S = 0.15
LEAN_DEG = 25.0
CAUGHT_SHARE = 0.5
"""At the end the ball is above where it hung by more than this share of the hanging length, and stays."""


def check_gravity(recording: Recording) -> None:
    """Raise InputError where the ball at rest does not hang below the cup: then z does not point up."""
    hang = _hanging(recording)
    if hang is None:
        return
    lean = float(np.degrees(np.arccos(np.clip(-hang[2] / np.linalg.norm(hang), -1, 1))))
    if lean > LEAN_DEG:
        axis = int(np.abs(hang).argmax())
        name, sign = "xyz"[axis], "+-"[int(hang[axis] < 0)]
        up = f"-{name}" if sign == "+" else name
        raise InputError(
            recording.path,
            f"the ball hangs at rest {np.linalg.norm(hang):.2f} m toward {sign}{name}, {lean:.0f} deg from -z: "
            f"{up} points up, not z",
            remedy=recording.axes_remedy,
        )


def without_misses(swings: list[Recording]) -> list[Recording]:
    """The swings that ended in a catch where the ball tells so; all of them, with a warning, where none did."""
    judged = [(swing, _caught(swing)) for swing in swings]
    missed = [swing.name for swing, caught in judged if caught is False]
    kept = [swing for swing, caught in judged if caught is not False]
    if not missed:
        return swings
    names = ", ".join(missed)
    if not kept:
        first = replace(swings[0], warnings=(*swings[0].warnings, f"the ball was caught in none of: {names}"))
        return [first, *swings[1:]]
    warning = f"left out, the ball was not caught: {names} (capture.misses=keep)"
    return [replace(kept[0], warnings=(warning, *kept[0].warnings)), *kept[1:]]


def _hanging(recording: Recording) -> Array | None:
    """From the cup to the ball (3,) where both rest at the start; None where they do not, or the ball is held."""
    if recording.ball_m is None:
        return None
    first = recording.t_s <= REST_S
    away = (recording.ball_m - recording.position_m)[first]
    away = away[np.isfinite(away).all(axis=1)]
    if len(away) < 3:
        return None
    middle = np.median(away, axis=0)
    far = float(np.linalg.norm(middle))
    moving = float(np.linalg.norm(away[-1] - away[0])) / REST_S
    return middle if SHORTEST_M < far < LONGEST_M and moving < STILL_M_S else None


def _caught(recording: Recording) -> bool | None:
    """Whether the ball ended in the cup; None where the recording does not tell."""
    hang = _hanging(recording)
    if hang is None or recording.ball_m is None:
        return None
    last = recording.t_s >= recording.t_s[-1] - REST_S
    away = (recording.ball_m - recording.position_m)[last]
    away = away[np.isfinite(away).all(axis=1)]
    if len(away) < 3:
        return None
    return bool((away[:, 2] > hang[2] + CAUGHT_SHARE * np.linalg.norm(hang)).all())
