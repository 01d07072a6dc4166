"""Where a recorded motion begins and ends: found by speed, not by hand."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import uniform_filter1d

from kendama_cli.schema.arrays import Array

REST_WINDOW_S = 0.2
"""Long enough to tell rest from noise: 1 mm of it at 100 Hz leaves 0.01 m/s; short beside a swing of a second."""

STILL_SHARE = 0.2
"""Below this share of the resting speed an end is at rest; above it, the fit must decide."""


@dataclass(frozen=True)
class Moving:
    """The moving part of n samples: ``first`` to ``last`` (inclusive), and the speed (n,) by which it was found.

    ``even`` says whether the samples come at equal steps.
    """

    first: int
    last: int
    even: bool
    speed_m_s: Array
    rest_m_s: float

    def still_at(self, sample: int) -> bool:
        """Whether the hand certainly rests at ``sample``."""
        return bool(self.speed_m_s[sample] < STILL_SHARE * self.rest_m_s)


def moving_part(t_s: Array, position_m: Array, *, rest_speed_m_s: float, rest_share: float) -> Moving:
    """The part of samples (n,), (n, k) between the first and the last that are faster than rest.

    Rest is below ``rest_speed_m_s`` or below ``rest_share`` of the peak speed. Raises ValueError where nothing moves.
    """
    step_s = (t_s[-1] - t_s[0]) / (len(t_s) - 1)
    even = is_even(t_s)
    if even:
        speed = smooth_speed(position_m, step_s)
    else:
        grid = np.linspace(t_s[0], t_s[-1], len(t_s))
        resampled = np.column_stack([np.interp(grid, t_s, column) for column in position_m.T])
        speed = np.interp(t_s, grid, smooth_speed(resampled, step_s))
    peak = float(speed.max())
    if peak <= rest_speed_m_s:
        raise ValueError(
            f"the hand never moves faster than {rest_speed_m_s} m/s (peak {peak:.4g}); "
            "lower encode.rest_speed_m_s or record the swing again"
        )
    rest = max(rest_speed_m_s, rest_share * peak)
    fast = speed > rest
    return Moving(int(fast.argmax()), len(fast) - 1 - int(fast[::-1].argmax()), even, speed, rest)


def is_even(t_s: Array) -> bool:
    """Whether the samples come at equal steps."""
    steps = t_s[1:] - t_s[:-1]
    return bool(steps.max() - steps.min() <= 1e-6 * (t_s[-1] - t_s[0]) / len(steps))


def smooth_speed(position: Array, step_s: float) -> Array:
    """Speed (n,) of even samples (n, k): the mean place of the half window ahead less that of the half behind.

    Running sums make it independent of the window. At the ends the speed is that of the first and last whole window.
    """
    n = len(position)
    half = min(max(2, round(REST_WINDOW_S / step_s / 2)), (n - 1) // 2)
    # means[:, i] is over ``half`` samples from i - middle on
    means, middle = uniform_filter1d(np.ascontiguousarray(position.T), half, axis=1), half // 2
    difference = means[:, half + 1 + middle : n - half + middle + 1] - means[:, middle : n - 2 * half + middle]
    speed = np.empty(n)
    speed[half : n - half] = np.sqrt((difference**2).sum(axis=0)) / ((half + 1) * step_s)
    speed[:half], speed[n - half :] = speed[half], speed[n - half - 1]
    return speed
