"""Checks that a hand can make a recorded motion: no frozen samples, no jumps, from rest.

What no hand does is refused, what a good recording hardly ever shows is told.
"""

from __future__ import annotations

import numpy as np

from kendama_cli.devices.demonstrator.recording import Recording
from kendama_cli.errors import InputError
from kendama_cli.motion.sampling import step_s
from kendama_cli.schema.arrays import Array

LAG_S = 0.01
"""Accelerations are taken over so much time before and after: a ball's impact on a hand is over sooner."""
LONG_LAG_S = 0.05
"""Over so much, noise of some millimetres is no acceleration any more."""
ABOVE_NOISE = 10.0
"""A recording's own median acceleration times this is noise, for a swing's peak is 3 to 5 times its median."""

FROZEN_HIDES_M = 0.01
"""A place that stands still while the hand moved on by so much is refused: at 25 mm of error no tau catches."""
FROZEN_DOUBT_M = 0.003

DOUBT_M_S2 = 80.0
MOVING_START, MOVING_END = 0.25, 0.5
"""Shares of the peak speed: a hand that begins or ends faster was not recorded from the beginning or to the end."""
SHORT_S = 0.6
"""A rise and a fall over the length of the rope take about as long; swings that we know take 0.7 to 3.5 s."""


def acceleration(t_s: Array, position_m: Array, lag_s: float) -> tuple[Array, int]:
    """Return the divided second differences over ``lag_s`` on either side (n - 2 k,) [m/s^2], and k samples of lag."""
    k = min(max(1, round(lag_s / step_s(t_s))), (len(t_s) - 1) // 2)
    before = (position_m[k:-k] - position_m[: -2 * k]) / (t_s[k:-k] - t_s[: -2 * k])[:, None]
    after = (position_m[2 * k :] - position_m[k:-k]) / (t_s[2 * k :] - t_s[k:-k])[:, None]
    return np.linalg.norm(after - before, axis=1) / (t_s[2 * k :] - t_s[: -2 * k]) * 2, k


def check_jumps(recording: Recording, limit_m_s2: float) -> None:
    """Raise InputError where an acceleration is above ``limit_m_s2`` and above what the recording's noise makes."""
    reached, k = acceleration(recording.t_s, recording.position_m, LAG_S)
    if reached.max() > max(limit_m_s2, ABOVE_NOISE * float(np.median(reached))):
        remedy = "rows are missing or the tracker lost the hand there: cut or fill that part, or record the swing again"
        raise _impossible(recording, reached, k, limit_m_s2, remedy)


def check_rate(recording: Recording, limit_m_s2: float) -> None:
    """Raise InputError where the hand accelerates by more than ``limit_m_s2`` for 0.1 s: no noise, but a wrong rate."""
    reached, k = acceleration(recording.t_s, recording.position_m, LONG_LAG_S)
    if reached.max() > limit_m_s2:
        times = "look at the time (capture.time_unit, capture.columns.time or capture.rate_hz); else "
        raise _impossible(recording, reached, k, limit_m_s2, times + recording.unit_remedy)


def _impossible(recording: Recording, reached: Array, k: int, limit_m_s2: float, remedy: str) -> InputError:
    t_s, place_m = recording.t_s, recording.position_m
    worst = int(reached.argmax())
    # the longest of the steps around it is the jump
    around = range(worst, min(worst + 2 * k, len(t_s) - 1))
    step = max(around, key=lambda i: float(np.linalg.norm(place_m[i + 1] - place_m[i])))
    moved_mm, lasted_ms = 1e3 * np.linalg.norm(place_m[step + 1] - place_m[step]), 1e3 * (t_s[step + 1] - t_s[step])
    return InputError(
        recording.path,
        f"an acceleration of {reached[worst]:.0f} m/s^2 (it moves by {moved_mm:.0f} mm within {lasted_ms:.3g} ms); a "
        f"hand reaches {limit_m_s2:g}",
        where=recording.place(step + 1),
        remedy=remedy,
    )


def check_frozen(recording: Recording) -> None:
    """Raise InputError where samples stand still amid the motion, longer than a turning hand does."""
    worst = max(_frozen(recording), key=lambda one: one[2], default=None)
    if worst is not None and worst[2] >= FROZEN_HIDES_M:
        first, last, hidden_m = worst
        lasted = recording.t_s[last] - recording.t_s[first]
        raise InputError(
            recording.path,
            f"the same place for {1e3 * lasted:.0f} ms ({last - first + 1} samples) amid the motion, while the hand "
            f"moved on by about {1e3 * hidden_m:.0f} mm",
            where=recording.place(first),
            remedy="the tracker was frozen there: cut or fill that part, or record the swing again",
        )


def doubts_of_continuity(recording: Recording) -> list[str]:
    """Return suspicious but possible findings, one sentence each."""
    t_s, place_m = recording.t_s, recording.position_m
    doubts = []
    frozen = [one for one in _frozen(recording) if one[2] >= FROZEN_DOUBT_M]
    if frozen:
        first, last, hidden_m = max(frozen, key=lambda one: one[2])
        doubts.append(
            f"{recording.place(first)}: the place stands still for {1e3 * (t_s[last] - t_s[first]):.0f} ms amid the "
            f"motion (about {1e3 * hidden_m:.0f} mm); a frozen tracker?"
        )
    reached, k = acceleration(t_s, place_m, LAG_S)
    worst = int(reached.argmax())
    if reached[worst] > max(DOUBT_M_S2, ABOVE_NOISE * float(np.median(reached))):
        doubts.append(
            f"{recording.place(worst + k)}: an acceleration of {reached[worst]:.0f} m/s^2, much above the rest of the "
            "swing; rows missing?"
        )
    duration_s = float(t_s[-1] - t_s[0])
    if duration_s < SHORT_S:
        doubts.append(f"it lasts {duration_s:.2f} s only; is the whole swing in it?")
    speeds = np.linalg.norm(np.diff(place_m, axis=0), axis=1) / np.diff(t_s)
    few = max(2, round(0.05 / step_s(t_s)))
    peak = float(np.quantile(speeds, 0.98))
    begins, ends = float(np.median(speeds[:few])), float(np.median(speeds[-few:]))
    if begins > MOVING_START * peak:
        doubts.append(
            f"the hand moves at {begins:.2g} m/s where it begins; the ball is taken to hang at rest there: record from "
            "rest, or look at capture.first_row"
        )
    if ends > MOVING_END * peak:
        doubts.append(f"the hand moves at {ends:.2g} m/s where it ends; is the catch in it?")
    return doubts


def _frozen(recording: Recording) -> list[tuple[int, int, float]]:
    """Return stretches of one position amid the motion: first and last sample, and the hand's displacement [m].

    That is the lesser of the speeds before and after, times how long it stood. A hand that turns round stands for a
    sample or two too, but does not go on by a jump.
    """
    t_s, place_m = recording.t_s, recording.position_m
    still = np.concatenate([[False], (np.diff(place_m, axis=0) == 0).all(axis=1), [False]])
    edges = np.flatnonzero(np.diff(still.astype(int)))
    few = max(2, round(0.03 / step_s(t_s)))
    found = []
    for first, last in zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True):
        if first < few or last + 1 + few >= len(t_s):
            continue
        speeds = [
            float(np.linalg.norm(place_m[b] - place_m[a]) / (t_s[b] - t_s[a]))
            for a, b in ((first - few, first), (last + 1, last + 1 + few))
        ]
        hidden_m = min(speeds) * float(t_s[last] - t_s[first])
        if np.linalg.norm(place_m[last + 1] - place_m[last]) > 0.5 * hidden_m:
            found.append((first, last, hidden_m))
    return found
