"""No reference and no command takes a joint beyond its limits: a million random periods of every bundled arm."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from numba import njit

from kendama_cli.robot_model.limits import JointLimits
from kendama_cli.schema.settings import build
from kendama_cli.settings.robot import RobotSettings
from kendama_cli.simulation.dart import drive_kernel
from kendama_cli.simulation.dart.drive_kernel import limit_rows
from tests.extras import require_robot_descriptions
from tests.shipped_conf import CONF, plain
from tests.simulation.dart.bench_robot import modelled

PERIODS = 1_000_000
ROUNDING = 1e-6
"""Of a limit. Places of some rad are exact to 1e-16: second differences of them over 1 ms to 1e-9 rad/s^2."""
Array = Any


@njit(cache=True)
def _drawn(  # noqa: PLR0917 - plain numbers and arrays, as compiled code takes them
    q: float, v: float, kind: int, limits: Array, i: int, period: float, t: float, held: Array
) -> Any:
    """A reference (place, speed, acceleration) of some kind for the joint whose state is ``q``, ``v``."""
    lower, upper, fastest, top = limits[0, i], limits[1, i], limits[2, i], limits[3, i]
    if kind == 0:  # anything, held for a while
        return held[i, 0], held[i, 1], held[i, 2]
    if kind == 1:  # at constant acceleration from where the joint is, too fast, beyond the stops
        a = 2.0 * top * held[i, 3]
        return q + period * v + 0.5 * period**2 * a, v + period * a, a
    if kind == 2:  # a place at or beyond a stop, at rest
        return (upper if held[i, 3] > 0 else lower) + max(held[i, 4], 0.0) * np.sign(held[i, 3]), 0.0, 0.0
    if kind == 3:  # a sine over the whole range, near the limits of speed and acceleration
        size, center = 0.5 * (upper - lower) * (1.0 + 0.05 * held[i, 4]), 0.5 * (lower + upper)
        rate = min(fastest / size, math.sqrt(top / size)) * (1.0 + 0.3 * held[i, 3])
        wave = center + size * math.sin(rate * t), size * rate * math.cos(rate * t)
        return wave[0], wave[1], -size * rate**2 * math.sin(rate * t)
    if kind == 4:  # somewhere about what can be reached, anew in every period
        change = 1.2 * top * period * np.random.uniform(-1.0, 1.0)  # noqa: NPY002 - compiled code has no Generator here
        bend = 0.3 * top * period**2 * np.random.uniform(-1.0, 1.0)  # noqa: NPY002
        return q + period * (v + 0.5 * change) + bend, v + change, held[i, 2]
    bad = (math.nan, math.inf, -math.inf, 1e300, -1e300)[int(abs(held[i, 3]) * 4.999)]
    return (bad, 0.0, 0.0) if held[i, 4] > 0 else (q, bad, bad)


@njit(cache=True)
def _worst(limits: Array, period: float, periods: int, seed: int, commands: bool) -> Array:
    """The most of each limit that was reached: stops (beyond them, rad), speed, mean speed, three accelerations."""
    np.random.seed(seed)  # noqa: NPY002
    n = limits.shape[1]
    fastest, top = limits[2], limits[3]
    state = np.zeros((3, n))
    state[0] = 0.5 * (limits[0] + limits[1])
    position, speed, bend, change = np.empty(n), np.empty(n), np.empty(n), np.empty(n)
    q1, v1, mean, worst = np.empty(n), np.empty(n), np.zeros(n), np.zeros(6)
    held, kind, left = np.zeros((n, 5)), np.zeros(n, np.int64), np.zeros(n, np.int64)
    for k in range(periods):
        for i in range(n):
            if left[i] == 0:
                left[i] = int(math.exp(np.random.uniform(0.0, 7.0)))  # noqa: NPY002
                kind[i] = np.random.randint(0, 5 if commands else 6)  # noqa: NPY002
                scale = math.exp(np.random.uniform(-5.0, 4.0))  # noqa: NPY002
                for j in range(5):
                    wild = scale * np.random.normal()  # noqa: NPY002
                    held[i, j] = wild if j < 3 else np.random.uniform(-1.0, 1.0)  # noqa: NPY002
            left[i] -= 1
            sampled = _drawn(state[0, i], state[1, i], kind[i], limits, i, period, k * period, held)
            position[i], speed[i], bend[i] = sampled
        before, last = state[0].copy(), state[1].copy()
        if commands:
            drive_kernel.nearest_state(before, last, position, speed, limits, period, q1, v1)
            state[0], state[1] = q1, v1
        else:
            drive_kernel.follow(position, speed, bend, state, limits, period, change)
        for i in range(n):
            q, v, m = state[0, i], state[1, i], (state[0, i] - before[i]) / period
            start = (6.0 * m - 4.0 * last[i] - 2.0 * v) / period
            end = (4.0 * v + 2.0 * last[i] - 6.0 * m) / period
            found = (
                max(q - limits[1, i], limits[0, i] - q),
                abs(v) / fastest[i],
                abs(m) / fastest[i],
                abs(v - last[i]) / period / top[i],
                abs(m - mean[i]) / period / top[i],
                max(abs(start), abs(end)) / top[i],
            )
            for j in range(6):
                if not found[j] <= worst[j]:
                    worst[j] = found[j]
            mean[i] = m
    return worst


def _limits(name: str) -> JointLimits:
    values = plain("robot", name)
    if not str(values["path"]).startswith("data/"):
        require_robot_descriptions()
    else:
        values["path"] = str(CONF.parent / values["path"])
    return modelled(build(RobotSettings, values, "robot")).limits


@pytest.mark.parametrize("robot", ["pa10", "iiwa", "ur5", "ur10", "panda", "xarm7"])
def test_no_random_reference_takes_a_bundled_arm_s_drive_beyond_any_limit(robot: str) -> None:
    beyond_rad, *fractions = _worst(limit_rows(_limits(robot), 0.001), 0.001, PERIODS, 1, False).tolist()
    assert beyond_rad <= 0.0
    assert max(fractions) <= 1.0 + ROUNDING
    assert min(fractions) > 0.99, "the references did not try all limits"


@pytest.mark.parametrize("period_s", [0.001, pytest.param(0.004, marks=pytest.mark.slow), 0.02])
def test_no_random_command_takes_what_is_sent_beyond_any_limit(period_s: float) -> None:
    rows = limit_rows(_limits("pa10"), period_s)
    beyond_rad, *fractions = _worst(rows, period_s, PERIODS, 2, True).tolist()
    assert beyond_rad <= 0.0
    assert max(fractions) <= 1.0 + ROUNDING
    assert min(fractions) > 0.99, "the commands did not try all limits"
