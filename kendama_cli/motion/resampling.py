"""From recorded samples to what the regression reads: even spacing, the moving part, derivatives, ends."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.signal import savgol_filter

from kendama_cli.artifacts.checks import Array

REST_WINDOW_S = 0.2
"""Long enough to tell rest from noise, shorter than the margins that are kept on both sides together."""


@dataclass(frozen=True)
class Swing:
    """A demonstration evenly sampled over its own duration, relative to its start.

    ``share`` (n,) is s = t / T from 0 to 1; ``position_m`` (n, 3) starts at zero; ``rate`` and ``second`` (n, 3) are
    derivatives by s [m]; ``goal_m`` (3,) is its end. ``onset_s`` is where it begins in the recording's own time.
    """

    share: Array
    position_m: Array
    rate: Array
    second: Array
    goal_m: Array
    start_rate: Array
    duration_s: float
    onset_s: float


def even(t_s: Array, position_m: Array) -> tuple[Array, Array]:
    """The samples (n,), (n, 3) at even steps, as many as there were, by cubic splines; even ones stay as they are."""
    steps = np.diff(t_s)
    grid = np.linspace(t_s[0], t_s[-1], len(t_s))
    if np.ptp(steps) <= 1e-6 * steps.mean():
        return grid, np.array(position_m)
    return grid, np.asarray(CubicSpline(t_s, position_m, axis=0)(grid))


def derivative(position: Array, step: float, order: int, window: int) -> Array:
    """The ``order``-th derivative of even samples (n, k) by local cubics over ``window`` samples (Savitzky-Golay)."""
    return np.asarray(savgol_filter(position, window, 3, deriv=order, delta=step, axis=0, mode="interp"))


def smooth_speed(position: Array, step_s: float) -> Array:
    """Speed (n,) by local lines over ``REST_WINDOW_S``: 1 mm of noise at 100 Hz leaves less than 0.01 m/s of it."""
    window = window_samples(REST_WINDOW_S, step_s, len(position))
    velocity = savgol_filter(position, window, 1, deriv=1, delta=step_s, axis=0, mode="interp")
    return np.asarray(np.linalg.norm(velocity, axis=1))


def window_samples(smoothing_s: float, step_s: float, count: int) -> int:
    """The odd number of samples nearest to ``smoothing_s``, at least 5 and at most ``count``."""
    wanted = max(5, 2 * round(smoothing_s / step_s / 2) + 1)
    return min(wanted, count if count % 2 else count - 1)


def moving_part(t_s: Array, speed_m_s: Array, rest_speed_m_s: float, margin_s: float) -> slice:
    """The samples from ``margin_s`` before the first to ``margin_s`` after the last that is faster than rest.

    Raises ValueError where nothing moves.
    """
    fast = np.flatnonzero(speed_m_s > rest_speed_m_s)
    if not len(fast):
        raise ValueError(
            f"the hand never moves faster than {rest_speed_m_s} m/s (peak {speed_m_s.max():.4g}); "
            "lower encode.rest_speed_m_s or record the swing again"
        )
    first = int(np.searchsorted(t_s, t_s[fast[0]] - margin_s - 1e-9))
    last = int(np.searchsorted(t_s, t_s[fast[-1]] + margin_s + 1e-9))
    return slice(first, last)


def swing(
    t_s: Array,
    position_m: Array,
    *,
    smoothing_s: float,
    rest_speed_m_s: float,
    rest_share: float,
    margin_s: float | None,
) -> Swing:
    """Prepare samples (n,), (n, 3): even spacing, resting ends cut (``margin_s`` None: kept), relative to the start.

    The hand rests below ``rest_speed_m_s`` and below ``rest_share`` of its peak speed. Start, end and their velocities
    are those of the local cubics; a start at rest has none. Raises ValueError where nothing moves or fewer than 5
    samples are left.
    """
    t, p = even(t_s, position_m)
    if len(t) < 5:
        raise ValueError(f"a swing needs at least 5 samples, not {len(t)}")
    step_s = float(t[1] - t[0])
    window = window_samples(smoothing_s, step_s, len(t))
    velocity = derivative(p, step_s, 1, window)
    speed = smooth_speed(p, step_s)
    rest = max(rest_speed_m_s, rest_share * float(speed.max()))
    part = slice(0, len(t)) if margin_s is None else moving_part(t, speed, rest, margin_s)
    t, p, velocity, speed = t[part], p[part], velocity[part], speed[part]
    if len(t) < 5:
        raise ValueError(f"only {len(t)} samples move; a swing needs at least 5")
    duration = float(t[-1] - t[0])
    window = window_samples(smoothing_s, step_s, len(t))
    smooth = derivative(p, step_s, 0, window)
    # the wide window sees motion that only begins soon, the narrow one sees noise: both must see it move
    starts_moving = min(speed[0], float(np.linalg.norm(velocity[0]))) > rest
    start_velocity = velocity[0] if starts_moving else np.zeros(p.shape[1])
    return Swing(
        share=(t - t[0]) / duration,
        position_m=p - smooth[0],
        rate=velocity * duration,
        second=derivative(p, step_s, 2, window) * duration**2,
        goal_m=smooth[-1] - smooth[0],
        start_rate=start_velocity * duration,
        duration_s=duration,
        onset_s=float(t[0]),
    )
