"""Several swings in one recording, cut apart where the hand rests between them."""

from __future__ import annotations

import functools
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from kendama_cli.devices.demonstrator.recording import MIN_SAMPLES, Recording
from kendama_cli.devices.demonstrator.recording_checks import check_samples, check_swing
from kendama_cli.devices.demonstrator.settings import PlausibleSettings
from kendama_cli.devices.demonstrator.swing_axes import NEVER_RISES, rise_of
from kendama_cli.motion.dmp.onset import REST_WINDOW_S, SmoothSpeed
from kendama_cli.schema.arrays import Array

REST_SPEED_M_S, REST_FRACTION = 0.05, 0.05
SHORT_REST_S = 0.25
"""A hand may rest so long within a swing, while the ball flies; so both sides must be swings of their own."""
LONG_REST_S = 0.65
"""No ball on a rope of 0.42 m flies longer than 0.6 s: a hand that rests so long has ended its swing."""
MARGIN_S = 0.25
"""So much of the rest is left on either side; two parts overlap in no more than the rest between them."""
SLOW_FRACTION = 0.4
"""A movement whose peak speed is below this fraction of the fastest one's is a return."""
MIN_S = 0.3
SWING_RISE = 0.5


def checked_swings(
    recording: Recording, plausible: PlausibleSettings, gap_factor: float, segments: str
) -> list[Recording]:
    """Return the checked swings in one recording, each with its warnings; the first also lists what was left out.

    Raises InputError where samples are missing, or a part is no swing that a hand can make.
    """
    check_samples(recording, gap_factor)
    swings, left = cut_apart(recording) if segments == "auto" else ([recording], [])
    checked: list[Recording] = []
    for swing in swings:
        doubts = [f"{swing.name}: {doubt}" for doubt in check_swing(swing, plausible)]
        checked.append(replace(swing, warnings=recording.warnings + tuple(doubts) if not checked else tuple(doubts)))
    about = tuple(f"{recording.name}: {one}" for one in left)
    return [replace(checked[0], warnings=about + checked[0].warnings), *checked[1:]]


def cut_apart(recording: Recording) -> tuple[list[Recording], list[str]]:
    """Split ``recording`` into swings, in order, and sentences on what was left out; itself if it is one swing."""
    t_s, position_m = recording.t_s, recording.position_m
    try:
        whole = SmoothSpeed(t_s, position_m).moving(REST_WINDOW_S, REST_SPEED_M_S, REST_FRACTION)
    except ValueError:
        return [recording], []
    pieces = _joined(recording, _stretches(t_s, whole.speed_m_s > whole.rest_m_s))
    if len(pieces) < 2:
        return [recording], []
    peaks = [float(whole.speed_m_s[first : last + 1].max()) for first, last in pieces]
    kept, left = [], []
    for (first, last), peak in zip(pieces, peaks, strict=True):
        lasts_s = float(t_s[last] - t_s[first])
        if peak < SLOW_FRACTION * max(peaks) or lasts_s < MIN_S:
            left.append(
                f"left out: {lasts_s:.1f} s from {t_s[first]:.1f} s on, where the hand reaches {peak:.2f} m/s only: "
                "no swing but a return, say (capture.segments=one keeps it)"
            )
        else:
            kept.append((first, last))
    if not kept:  # jumps faster than any hand, say: the checks of one swing say what is wrong
        return [recording], []
    rises = [_rises(recording, piece) for piece in kept]
    if max(rises, default=0.0) >= SWING_RISE:
        for first, last in [piece for piece, rise in zip(kept, rises, strict=True) if rise <= NEVER_RISES]:
            kept.remove((first, last))
            left.append(
                f"left out: {t_s[last] - t_s[first]:.1f} s from {t_s[first]:.1f} s on, with which a ball never rises "
                "over the cup, as it does elsewhere in the recording: a return, say (capture.segments=one keeps it)"
            )
    return [_part(recording, one, number, len(kept)) for number, one in enumerate(kept, start=1)], left


def _stretches(t_s: Array, fast: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """Return the first and last samples of the moving stretches that rests of SHORT_REST_S or longer separate."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], fast, [False]]).astype(int)))
    found: list[tuple[int, int]] = []
    for first, after in zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True):
        if found and t_s[first] - t_s[found[-1][1]] < SHORT_REST_S:
            found[-1] = (found[-1][0], after - 1)
        else:
            found.append((first, after - 1))
    return found


def _joined(recording: Recording, pieces: list[tuple[int, int]]) -> list[tuple[int, int]]:
    """Join neighbours unless the rest between them is long, or both are swings of their own."""
    t_s = recording.t_s
    joined = pieces[:1]

    @functools.cache
    def is_swing(piece: tuple[int, int]) -> bool:
        return _rises(recording, piece) >= SWING_RISE

    for piece in pieces[1:]:
        before = joined[-1]
        long = t_s[piece[0]] - t_s[before[1]] >= LONG_REST_S
        if long or (is_swing(before) and is_swing(piece)):
            joined.append(piece)
        else:
            joined[-1] = (before[0], piece[1])
    return joined


def _rises(recording: Recording, piece: tuple[int, int]) -> float:
    """Return the fraction of ropes and time scales with which a ball rises over the cup."""
    part = slice(max(piece[0] - 2, 0), piece[1] + 3)
    t_s = recording.t_s[part]
    if len(t_s) < MIN_SAMPLES or t_s[-1] - t_s[0] < MIN_S:
        return 0.0
    (rise,) = rise_of(t_s, recording.position_m[part], np.array([[0.0, 0.0, 1.0]]))
    return rise.rising


def _part(recording: Recording, piece: tuple[int, int], number: int, count: int) -> Recording:
    """Return the samples of ``piece`` with those around it that belong to no other."""
    t_s = recording.t_s
    first = int(np.searchsorted(t_s, t_s[piece[0]] - MARGIN_S))
    last = int(np.searchsorted(t_s, t_s[piece[1]] + MARGIN_S, side="right"))
    part = recording.rows(np.arange(first, last))
    return replace(part, name=recording.name if count == 1 else f"{recording.name}-{number}", t_s=part.t_s - t_s[first])
