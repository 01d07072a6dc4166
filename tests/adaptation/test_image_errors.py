"""Images with the errors of a laboratory's cameras, against the declared figures."""

from __future__ import annotations

import numpy as np
import pytest

from kendama_cli.adaptation.image_errors import EXACT, ImageErrors, SensorErrors

SIGMA_M = np.array([0.001, 0.002, 0.001])
FRAMES = 20_000


def _seen(errors: SensorErrors) -> tuple[np.ndarray, np.ndarray]:
    """Stamps, and what the images show of a ball that goes 1 m/s along x."""
    images = ImageErrors(errors, SIGMA_M, np.random.default_rng(10000))
    made = [images.image(0.01 * k, np.array([0.01 * k, 0.0, 0.0])) for k in range(FRAMES)]
    return np.array([stamp for stamp, _ in made]), np.array([ball for _, ball in made])


def test_a_late_image_shows_what_was_before_its_stamp_and_the_noise_is_that_of_an_exact_sensor() -> None:
    exact_s, exact = _seen(EXACT)
    late_s, late = _seen(SensorErrors(latency_s=0.015))
    assert late_s == pytest.approx(exact_s + 0.015, abs=1e-12)
    assert late.tobytes() == exact.tobytes()
    assert exact_s == pytest.approx(0.01 * np.arange(FRAMES), abs=0)


def test_repeated_images_show_the_one_before_under_their_own_stamps() -> None:
    stamps_s, seen = _seen(SensorErrors(repeated=0.3, repeated_stamp_s=0.004, seed=1))
    again = (np.diff(seen, axis=0) == 0.0).all(axis=1)
    assert np.mean(again) == pytest.approx(0.3, abs=4 * np.sqrt(0.21 / FRAMES))
    assert np.diff(stamps_s)[again] == pytest.approx(0.004, abs=1e-9)
    new = np.concatenate([[True], ~again])
    assert stamps_s[new] == pytest.approx(0.01 * np.flatnonzero(new), abs=1e-9)


def test_wrong_detections_are_off_by_the_declared_distance_in_any_direction() -> None:
    _, exact = _seen(EXACT)
    _, seen = _seen(SensorErrors(wrong=0.02, wrong_m=0.05, seed=1))
    off = np.linalg.norm(seen - exact, axis=1)
    wrong = off > 0.0
    assert np.mean(wrong) == pytest.approx(0.02, abs=4 * np.sqrt(0.02 * 0.98 / FRAMES))
    assert off[wrong] == pytest.approx(0.05, abs=1e-12)
    directions = (seen - exact)[wrong] / 0.05
    assert np.abs(directions.mean(axis=0)).max() < 4 / np.sqrt(3 * wrong.sum())
