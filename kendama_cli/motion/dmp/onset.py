"""Start and end of a recorded motion, found by speed, not by hand."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from kendama_cli.motion.sampling import columns_at
from kendama_cli.schema.arrays import Array

REST_WINDOW_S = 0.2
"""Long enough to tell rest from noise: 1 mm of it at 100 Hz leaves 0.01 m/s."""
REST_WINDOW_SHARE = 0.1
"""Of the motion itself, so that one path is cut alike however fast it is shown: a window of 0.2 s for one of 2 s."""
WINDOWS = 12
"""The part that is found changes with the window by about its length: a tenth of the error is left each time."""

STILL_SHARE = 0.2
"""Below this share of the resting speed an end is at rest; above it, the fit must decide."""


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
        middle = position_m - position_m.mean(axis=0)
        self._sums = np.vstack([0 * middle[:1], np.cumsum(steps * (middle[1:] + middle[:-1]) / 2, axis=0)])

    def over(self, window_s: float) -> Array:
        """Return the mean position of the next half window minus that of the last, over half a window; (n,) [m/s].

        At the ends the speed is that of the first and last whole window.
        """
        t_s = self._t_s
        step_s, length_s = (t_s[-1] - t_s[0]) / (len(t_s) - 1), t_s[-1] - t_s[0]
        half_s = min(max(2 * step_s, window_s / 2), length_s / 2)
        at = np.clip(t_s, t_s[0] + half_s, t_s[-1] - half_s)
        behind, here, ahead = (columns_at(at + shift, t_s, self._sums) for shift in (-half_s, 0.0, half_s))
        return np.asarray(np.linalg.norm(ahead - 2 * here + behind, axis=1) / half_s**2)

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
    share = above[inside] / (above[inside] - above[outside])
    return float(t_s[inside] + share * (t_s[outside] - t_s[inside]))
