"""The noise that a rollout is drawn with."""

from __future__ import annotations

import dataclasses
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


def test_bodies_are_drawn_evenly_from_their_ranges_and_differ_in_all_readings_alike() -> None:
    settings = dataclasses.replace(learn_settings())
    bodies = dataclasses.replace(
        settings.randomisation, rope=0.1, drag=(0.5, 3.0), noise=(0.0, 0.0), acceleration=0.2, angle_deg=3.0,
        delay_s=0.04, workspace_shrink=0.3,
    )  # fmt: skip
    drawn = [draw_noise(settings, bodies, np.random.default_rng(seed)) for seed in range(400)]
    steps = 0.04 / settings.step_s
    for values, low, high in (
        ([one.rope_scale for one in drawn], 0.9, 1.1),
        ([one.drag_scale for one in drawn], 0.5, 3.0),
        ([one.gain[0] for one in drawn], 0.8, 1.2),
        ([one.angle_rad[0] for one in drawn], -math.radians(3.0), math.radians(3.0)),
        ([one.delay_steps for one in drawn], 0, steps),
        ([one.workspace_scale for one in drawn], 0.7, 1.0),
    ):
        assert low <= min(values) < low + 0.03 * (high - low)
        assert high - 0.03 * (high - low) < max(values) <= high
    assert all(len(set(one.gain)) == len(set(one.angle_rad)) == 1 for one in drawn)
    assert not any(one.start_angle_rad or one.start_position_m or any(one.rate_rad_s) for one in drawn)
    noisy = dataclasses.replace(bodies, noise=(2.0, 2.0), angle_deg=0.0, acceleration=0.0)
    one, twice = (
        draw_noise(settings, each, np.random.default_rng(1))
        for each in (dataclasses.replace(noisy, noise=(1.0, 1.0)), noisy)
    )
    for name in ("start_angle_rad", "start_position_m", "angle_rad", "rate_rad_s"):
        assert np.array(getattr(twice, name)) == pytest.approx(2 * np.array(getattr(one, name)))
    assert np.array(twice.gain) - 1 == pytest.approx(2 * (np.array(one.gain) - 1))
    assert len(one.gain) == round(settings.rollout_s / settings.step_s)
