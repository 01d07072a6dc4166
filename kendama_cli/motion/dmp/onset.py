"""Samples for the regression: start and end of a recorded motion, found by speed, and its samples at even times."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline

from kendama_cli.motion.sampling import columns_at
from kendama_cli.schema.arrays import Array

REST_WINDOW_S = 0.2
"""Long enough to tell rest from noise: 1 mm of it at 100 Hz leaves 0.01 m/s."""
REST_WINDOW_SHARE = 0.1
"""Of the motion itself, so that one path is cut alike however fast it is shown: a window of 0.2 s for one of 2 s."""
WINDOWS = 12
"""The part that is found changes with the window by about its length: a tenth of the error is left each time."""

STILL_SHARE = 0.2
"""Below this fraction of the resting speed an end is at rest; above it, the fit must decide."""


@dataclass(frozen=True)
class Moving:
    """The moving part of a recording at ``t_s`` (n,): from ``begin_s`` to ``end_s``, which may lie between samples.

    ``even`` says whether the samples come at equal steps; by ``speed_m_s`` (n,) the part was found.
    """

    begin_s: float
    end_s: float
    even: bool
    t_s: Array
    speed_m_s: Array
    rest_m_s: float

    def still_at(self, t_s: float) -> bool:
        """Return True if the motion certainly rests at ``t_s``."""
        return bool(np.interp(t_s, self.t_s, self.speed_m_s) < STILL_SHARE * self.rest_m_s)

    def fast_at(self, t_s: float) -> bool:
        """Return True if it certainly moves at ``t_s``; between samples the part's own ends count as rest."""
        return bool(np.interp(t_s, self.t_s, self.speed_m_s) > self.rest_m_s * (1 + 1e-9))


def moving_part(t_s: Array, position_m: Array, *, rest_speed_m_s: float, rest_fraction: float) -> Moving:
    """Return the part of samples (n,), (n, k) between the first and the last time at which they are faster than
    rest.

    Rest is below ``rest_speed_m_s`` or below ``rest_fraction`` of the peak speed. The speed is smoothed over
    REST_WINDOW_SHARE of the part that is found with it. Raises ValueError where nothing moves.
    """
    speeds = SmoothSpeed(t_s, position_m)
    found = speeds.moving(REST_WINDOW_S, rest_speed_m_s, rest_fraction)
    for _ in range(WINDOWS):
        found = speeds.moving(REST_WINDOW_SHARE * (found.end_s - found.begin_s), rest_speed_m_s, rest_fraction)
    return found


def is_even(t_s: Array) -> bool:
    """Return True if the samples come at equal steps."""
    steps = t_s[1:] - t_s[:-1]
    return bool(steps.max() - steps.min() <= 1e-6 * (t_s[-1] - t_s[0]) / len(steps))


class SmoothSpeed:
    """The speed of samples (n,), (n, k), even or not, smoothed over any window."""

    def __init__(self, t_s: Array, position_m: Array) -> None:
        self._t_s = t_s
        steps = np.diff(t_s)[:, None]
        center = position_m - position_m.mean(axis=0)
        self._sums = np.vstack([0 * center[:1], np.cumsum(steps * (center[1:] + center[:-1]) / 2, axis=0)])

    def over(self, window_s: float) -> Array:
        """Return the mean position of the next half window minus that of the last, over half a window; (n,) [m/s].

        At the ends the speed is that of the first and last whole window.
        """
        t_s = self._t_s
        step_s, length_s = (t_s[-1] - t_s[0]) / (len(t_s) - 1), t_s[-1] - t_s[0]
        half_s = min(max(2 * step_s, window_s / 2), length_s / 2)
        at = np.clip(t_s, t_s[0] + half_s, t_s[-1] - half_s)
        past, here, ahead = (columns_at(at + shift, t_s, self._sums) for shift in (-half_s, 0.0, half_s))
        return np.asarray(np.linalg.norm(ahead - 2 * here + past, axis=1) / half_s**2)

    def moving(self, window_s: float, rest_speed_m_s: float, rest_fraction: float) -> Moving:
        """Return the part that moves, by the speed over ``window_s``; raises ValueError if nothing moves."""
        t_s, speed = self._t_s, self.over(window_s)
        peak = float(speed.max())
        if peak <= rest_speed_m_s:
            raise ValueError(
                f"the hand never moves faster than {rest_speed_m_s} m/s (peak {peak:.4g}); "
                "lower encode.rest_speed_m_s or record the swing again"
            )
        rest = max(rest_speed_m_s, rest_fraction * peak)
        fast = np.flatnonzero(speed > rest)
        ends = [
            float(t_s[one] if beyond in (-1, len(t_s)) else _crossing(t_s, speed - rest, one, beyond))
            for one, beyond in ((fast[0], fast[0] - 1), (fast[-1], fast[-1] + 1))
        ]
        return Moving(ends[0], ends[1], is_even(t_s), t_s, speed, rest)


def _crossing(t_s: Array, above: Array, inside: int, outside: int) -> float:
    """Return the time between two samples at which ``above`` is zero."""
    fraction = above[inside] / (above[inside] - above[outside])
    return float(t_s[inside] + fraction * (t_s[outside] - t_s[inside]))


MIN_SAMPLES = 5

LONGEST_GAP = 0.1
"""Fraction of the motion that may be missing in one piece: two basis functions of twenty still see its ends."""


@dataclass(frozen=True)
class TrimmedDemonstration:
    """The samples of one demonstration's motion.

    ``position_m`` (n, k) is relative to the first sample; ``uneven_share`` (n,) is s = t / T from 0 to 1, None where
    the samples come at equal steps. ``onset_s`` is where it begins in the recording's own time.
    ``starts_still`` and ``ends_still`` say that it certainly rests there, ``starts_fast`` and ``ends_fast`` that it
    certainly moves; between, the fit must decide.
    """

    position_m: Array
    uneven_share: Array | None
    duration_s: float
    onset_s: float
    starts_still: bool
    ends_still: bool
    starts_fast: bool
    ends_fast: bool

    @property
    def even(self) -> bool:
        """Return True if the samples come at equal steps."""
        return self.uneven_share is None

    @property
    def share(self) -> Array:
        """s (n,) of every sample."""
        return np.linspace(0.0, 1.0, len(self.position_m)) if self.uneven_share is None else self.uneven_share

    @property
    def t_s(self) -> Array:
        """The samples' times (n,) in the recording's own time."""
        return self.onset_s + self.duration_s * self.share


def cut(t_s: Array, position_m: Array, moving: Moving, head: float | None, tail: float | None) -> TrimmedDemonstration:
    """Return the moving part with ``head`` and ``tail`` of its duration before and after it; None keeps all samples.

    Its ends lie where the motion does, between samples too: even samples come at even steps between them, others
    stay, beside the ends. Raises ValueError where fewer than 5 samples are left, and naming the sample before a gap
    that is too long.
    """
    length_s = moving.end_s - moving.begin_s
    begin_s = t_s[0] if head is None else max(t_s[0], moving.begin_s - head * length_s)
    end_s = t_s[-1] if tail is None else min(t_s[-1], moving.end_s + tail * length_s)
    duration = float(end_s - begin_s)
    slack = 1e-9 * length_s
    first, last = np.searchsorted(t_s, [begin_s - slack, end_s + slack])
    if last - first < MIN_SAMPLES:
        raise ValueError(f"only {last - first} samples move; a swing needs at least {MIN_SAMPLES}")
    if moving.even:
        t = np.linspace(begin_s, end_s, round(duration * (len(t_s) - 1) / float(t_s[-1] - t_s[0])) + 1)
    else:
        inner = t_s[first:last]
        t = np.concatenate([[begin_s], inner[(inner > begin_s + slack) & (inner < end_s - slack)], [end_s]])
        steps = np.diff(t)
        longest = int(steps.argmax())
        # few samples are a low rate, not a gap
        if steps[longest] > max(LONGEST_GAP * duration, 2 * duration / len(t)):
            raise ValueError(
                f"after sample {first + longest + 1} nothing is known for {steps[longest]:.3g} s of a motion of "
                f"{duration:.3g} s; allowed: {LONGEST_GAP:.0%} of it; fill the gap or record the swing again"
            )
    p = between(t_s, position_m, t)
    return TrimmedDemonstration(
        position_m=p - p[0],
        uneven_share=None if moving.even else (t - t[0]) / duration,
        duration_s=duration,
        onset_s=float(begin_s),
        starts_still=moving.still_at(begin_s),
        ends_still=moving.still_at(end_s),
        starts_fast=moving.fast_at(begin_s),
        ends_fast=moving.fast_at(end_s),
    )


def between(t_s: Array, values: Array, at_s: Array) -> Array:
    """Interpolate the ``values`` (n, k) at ``t_s`` (n,) at other times (m,), by a cubic spline through them; (m, k)."""
    return np.asarray(CubicSpline(t_s, values, axis=0)(at_s))


def between_samples_m(position_m: Array) -> float:
    """Estimate how far a cubic between even samples (n, k) is off at most [m].

    Its error midway is 3/128 h^4 p'''' at the step h, and 16 times as much for a sample that is left out and
    seen from its neighbours at h and 3 h.
    """
    p = position_m
    left_out = p[3:-3] - (9 * (p[2:-4] + p[4:-2]) - (p[:-6] + p[6:])) / 16
    return float(np.linalg.norm(left_out, axis=1).max(initial=0.0)) / 16


def common_margins(t_s: Sequence[Array], moving: Sequence[Moving], wanted: float) -> tuple[float, float]:
    """Return the fractions of rest that all demonstrations have before and after their motion, at most ``desired``
    each.

    The same share for all: so their motions begin and end at the same shares and can be averaged.
    """
    heads, tails = [wanted], [wanted]
    for t, one in zip(t_s, moving, strict=True):
        length = one.end_s - one.begin_s
        heads.append((one.begin_s - t[0]) / length)
        tails.append((t[-1] - one.end_s) / length)
    return min(heads), min(tails)
