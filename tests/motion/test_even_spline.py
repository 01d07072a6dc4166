"""A cubic between two states ends in the second, and its rates are those of its positions."""

from __future__ import annotations

import numpy as np
import pytest

from kendama_cli.motion.even_spline import cubic_between


def test_a_cubic_ends_in_the_last_state_and_moves_as_its_rates_say() -> None:
    first = np.array([0.3, -1.0]), np.array([0.5, 2.0])
    last = np.array([-0.4, 0.7]), np.array([-1.5, 0.2])
    step_s, steps = 1e-3, 700
    positions, speeds, accelerations = cubic_between(first, last, steps=steps, step_s=step_s)
    assert positions[-1] == pytest.approx(last[0])
    assert speeds[-1] == pytest.approx(last[1])
    assert positions[0] == pytest.approx(first[0] + step_s * first[1], abs=1e-4)
    assert np.gradient(positions, step_s, axis=0)[1:-1] == pytest.approx(speeds[1:-1], abs=1e-4)
    assert np.gradient(speeds, step_s, axis=0)[1:-1] == pytest.approx(accelerations[1:-1], abs=1e-4)
