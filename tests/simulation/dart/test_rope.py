from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from kendama_cli.simulation.dart.rope import rope_force

ROPE = (0.40, 2000.0, 2.0)
place = st.floats(-1.0, 1.0)
speed = st.floats(-20.0, 20.0)


@given(st.tuples(place, place, place), st.tuples(speed, speed, speed))
def test_the_rope_never_pushes_and_pulls_along_itself(
    ball: tuple[float, float, float], velocity: tuple[float, float, float]
) -> None:
    force = rope_force(*ball, *velocity, *ROPE)
    if force is None:
        return
    along = np.dot(force, ball)
    assert along < 0
    assert np.linalg.norm(np.cross(force, ball)) < 1e-9 * abs(along) + 1e-12


def test_a_slack_rope_has_no_force() -> None:
    assert rope_force(0.0, 0.0, -0.399, 0.0, 0.0, -5.0, *ROPE) is None


def test_a_taut_rope_pulls_with_spring_and_damper() -> None:
    assert rope_force(0.0, 0.0, -0.41, 0.0, 0.0, -0.5, *ROPE) == pytest.approx((0.0, 0.0, 2000 * 0.01 + 2 * 0.5))


def test_a_damper_that_outweighs_the_spring_gives_no_push() -> None:
    assert rope_force(0.0, 0.0, -0.4001, 0.0, 0.0, 5.0, *ROPE) is None


@pytest.mark.parametrize(("dt", "ripple"), [(1e-3, 1e-2), (1e-4, 1e-3)])
@pytest.mark.parametrize("start", [(0.3, 0.0, 0.2, 0.0), (0.05, 0.35, -1.5, 2.0), (0.39, 0.1, 0.0, -3.0)])
def test_energy_never_grows_in_a_passive_rope(
    start: tuple[float, float, float, float], dt: float, ripple: float
) -> None:
    mass, gravity = 0.05, 9.81
    x, z, vx, vz = start
    peaks = []
    for _ in range(20):  # the peak over each 0.25 s
        peak = 0.0
        for _ in range(round(0.25 / dt)):
            force = rope_force(x, 0.0, z, vx, 0.0, vz, *ROPE) or (0.0, 0.0, 0.0)
            vx, vz = vx + dt * force[0] / mass, vz + dt * (force[2] / mass - gravity)
            x, z = x + dt * vx, z + dt * vz
            stretch = max(math.hypot(x, z) - ROPE[0], 0.0)
            potential = mass * gravity * (z + 1.0) + 0.5 * ROPE[1] * stretch**2
            peak = max(peak, 0.5 * mass * (vx * vx + vz * vz) + potential)
        peaks.append(peak)
    # while the rope is taut the energy of semi-implicit Euler ripples, in proportion to dt
    assert all(later <= earlier + ripple for earlier, later in pairwise(peaks))
    assert peaks[-1] < peaks[0] - 0.02
