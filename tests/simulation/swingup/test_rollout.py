"""The noise that a rollout is drawn with."""

from __future__ import annotations

import math

import numpy as np
import pytest

from kendama_cli.simulation.swingup.rollout import draw_noise
from tests.learning.settings_files import learn_settings


def test_the_noise_has_the_configured_spread() -> None:
    settings = learn_settings()
    noises = [draw_noise(settings, settings.randomisation, np.random.default_rng(seed)) for seed in range(1000)]
    # of 1000 draws a standard deviation is known to 2.2 %
    assert np.std([one.start_angle_rad for one in noises]) == pytest.approx(math.radians(2.0), rel=0.1)
    assert np.std([one.start_position_m for one in noises]) == pytest.approx(0.005, rel=0.1)
    first = noises[0]
    assert np.std(first.angle_rad) == pytest.approx(math.radians(1.0), rel=0.1)
    assert np.std(first.rate_rad_s) == pytest.approx(0.087, rel=0.1)
    assert np.std(first.gain) == pytest.approx(0.03, rel=0.1)
    assert 0.91 - 1e-12 <= min(first.gain) <= max(first.gain) <= 1.09 + 1e-12
