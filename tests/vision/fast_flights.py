"""Rallies of a light, fast ball in air: drag with the square of its speed and spin, integrated by scipy."""

import numpy as np
from scipy.integrate import solve_ivp

from kendama_cli.vision.flight_search import RecordedTrack

DRAG_PER_M = 0.12
TABLE_M = 0.02


def flown(start_m, velocity_m_s, spin_per_s, t_s, drag_per_m=DRAG_PER_M):
    """Places (n, 3) and velocities (n, 3) at ``t_s`` (n,)."""

    def slope(_, state):
        v = state[3:]
        return [*v, *(np.array([0, 0, -9.81]) - drag_per_m * np.linalg.norm(v) * v + np.cross(spin_per_s, v))]

    state = solve_ivp(slope, (0, t_s[-1]), [*start_m, *velocity_m_s], t_eval=t_s, rtol=1e-10, atol=1e-12).y
    return state[:3].T, state[3:].T


def rally(seed, *, spin_sigma_per_s, rate_hz=120.0, sigma_m=1e-3, strokes=2):
    """One recording: strokes of 4 to 8 m/s, each until the ball meets the table, and a bounce of 0.25 s after each."""
    rng = np.random.default_rng(seed)
    times, places, begin = [], [], 0.0
    for _ in range(strokes):
        speed, rise = rng.uniform(4, 8), rng.uniform(0.1, 0.5)
        start = np.array([-1.3, rng.uniform(-0.4, 0.4), rng.uniform(0.25, 0.5)])
        velocity = speed * np.array([np.cos(rise), rng.uniform(-0.15, 0.15), np.sin(rise)])
        spin = spin_sigma_per_s * rng.standard_normal(3)
        t = np.arange(0, 2.0, 1 / rate_hz)
        points, speeds = flown(start, velocity, spin, t)
        under = np.flatnonzero(points[:, 2] < TABLE_M)
        if len(under) == 0 or t[under[0]] < 0.25:
            continue
        last = under[0]
        again, _ = flown(points[last], speeds[last] * [0.7, 0.7, -0.85], 0.5 * spin, np.arange(0, 0.25, 1 / rate_hz))
        whole = np.concatenate([points[:last], again])
        times.append(begin + np.arange(len(whole)) / rate_hz)
        places.append(whole + sigma_m * rng.standard_normal(whole.shape))
        begin = times[-1][-1] + 1.0
    if not times:
        return RecordedTrack("ball", np.arange(2.0), np.zeros((2, 3))), 0
    return RecordedTrack("ball", np.concatenate(times), np.concatenate(places)), len(times)
