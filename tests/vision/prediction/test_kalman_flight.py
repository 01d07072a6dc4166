"""The estimator of a ball whose flight is disturbed: by a wobble of some colour, beside process noise."""

import numpy as np
import pytest

from kendama_cli.vision.prediction.catch_pose import CatchPoseEstimator
from kendama_cli.vision.settings import ColouredMotion
from tests.vision.scenes import stereo
from tests.vision.seen_flight import (
    CROSSING_M,
    CROSSING_S,
    DRAG,
    FLIGHT,
    RIM_M,
    SIGMA_PX,
    START,
    VELOCITY,
    stamps,
)

PROCESS = ColouredMotion("coloured", 1.0, 1e-9, 0.15, 0.05)
COLOURED = ColouredMotion("coloured", 1.0, 4e-3, 0.15, 0.0)
SEEN = np.arange(0.0, 0.2, 1 / 300)


def disturbed(motion, rng, sigma_m=2e-4):
    """Marker positions of a disturbed flight, 300 Hz, and where and when it truly crosses."""
    t = np.arange(0.0, CROSSING_S + 0.1, 1 / 300)
    if motion.intensity_m2_s3 > 0:
        kicks = np.sqrt(motion.intensity_m2_s3 / 300) * rng.standard_normal((len(t), 3))
        off = np.cumsum(np.cumsum(kicks, axis=0), axis=0) / 300
    else:
        d = np.sqrt(3) / motion.length_s * np.abs(t[:, None] - t)
        covariance = motion.sigma_m**2 * (1 + d) * np.exp(-d) + 1e-14 * np.eye(len(t))
        off = np.linalg.cholesky(covariance) @ rng.standard_normal((len(t), 3))
    points = FLIGHT.position_m(START, VELOCITY, t) + off
    last = int(np.flatnonzero(points[:, 2] > RIM_M)[-1])
    part = (points[last, 2] - RIM_M) / (points[last, 2] - points[last + 1, 2])
    crossing = points[last] + part * (points[last + 1] - points[last])
    return points[: len(SEEN)] + sigma_m * rng.standard_normal((len(SEEN), 3)), crossing, t[last] + part / 300


def estimator_of(points, motion):
    options = {} if motion is None else {"motion": motion, "of_marker": True}
    estimator = CatchPoseEstimator(9.81, DRAG, RIM_M, **options)
    for moment, point in zip(SEEN, points, strict=True):
        estimator.update_position(moment, point, (2e-4) ** 2 * np.eye(3))
    return estimator


@pytest.mark.parametrize("motion", [PROCESS, COLOURED])
def test_a_wobbling_ball_is_predicted_better_by_the_variant_that_expects_it_and_its_covariance_is_true(motion):
    """60 draws; mean normalised square of 2 numbers: 2 +- 0.26; nothing is scaled by the innovations."""
    rng = np.random.default_rng(16)
    errors, squares, ratios = [], [], []
    for _ in range(60):
        points, crossing, crossing_s = disturbed(motion, rng)
        knowing, plain = estimator_of(points, motion), estimator_of(points, None).catch()
        pose = knowing.catch()
        error = (pose.position_m - crossing)[:2]
        errors.append([np.sum(error**2), np.sum((plain.position_m - crossing)[:2] ** 2), (pose.t_s - crossing_s) ** 2])
        squares.append(error @ np.linalg.solve(pose.covariance_m2[:2, :2], error))
        ratios.append(knowing.residual_ratio)
    mine, plain, _ = np.sqrt(np.mean(errors, axis=0))
    assert mine < 0.9 * plain
    assert 1.0 < np.mean(squares) < 2.8
    assert 0.9 < np.mean(ratios) < 1.1


def test_the_ball_is_told_without_the_wobble_and_its_covariance_is_true():
    """200 draws; mean normalised square of 2 numbers: 2 +- 0.14, and twice that is three standard deviations."""
    rng, squares = np.random.default_rng(20), []
    for _ in range(200):
        points, _, _ = disturbed(COLOURED, rng)
        estimator = CatchPoseEstimator(9.81, DRAG, RIM_M, motion=COLOURED)
        for moment, point in zip(SEEN, points, strict=True):
            estimator.update_position(moment, point, (2e-4) ** 2 * np.eye(3))
        pose = estimator.catch()
        error = (pose.position_m - CROSSING_M)[:2]
        squares.append(error @ np.linalg.solve(pose.covariance_m2[:2, :2], error))
    assert 1.58 < np.mean(squares) < 2.42


def test_the_coloured_variant_is_generalised_least_squares():
    """Against the batch solution with the full residual covariance, which shares no code with the filter."""
    points, _, _ = disturbed(COLOURED, np.random.default_rng(17))
    d = np.sqrt(3) / COLOURED.length_s * np.abs(SEEN[:, None] - SEEN)
    covariance = COLOURED.sigma_m**2 * (1 + d) * np.exp(-d) + (2e-4) ** 2 * np.eye(len(SEEN))
    design = np.column_stack([np.ones_like(SEEN), FLIGHT.velocity_gain_s(SEEN)])
    left = points - FLIGHT.gravity_gain_s2(SEEN)[:, None] * FLIGHT.gravity_m_s2
    inverse = np.linalg.inv(covariance)
    weights = np.linalg.solve(design.T @ inverse @ design, design.T @ inverse @ left)
    d_end = np.sqrt(3) / COLOURED.length_s * np.abs(SEEN[-1] + 0.1 - SEEN)
    wobble = COLOURED.sigma_m**2 * (1 + d_end) * np.exp(-d_end) @ inverse @ (left - design @ weights)
    expected = FLIGHT.position_m(weights[0], weights[1], SEEN[-1] + 0.1) + wobble
    assert np.allclose(estimator_of(points, COLOURED).state_at(SEEN[-1] + 0.1)[:3], expected, atol=2e-6)


def test_wobble_that_was_not_expected_shows_in_the_residuals_and_widens_the_covariance():
    points, _, _ = disturbed(COLOURED, np.random.default_rng(18))
    wrong, right = estimator_of(points, None), estimator_of(points, COLOURED)
    assert wrong.residual_ratio > 3
    assert 0.7 < right.residual_ratio < 1.3


@pytest.mark.parametrize("motion", [PROCESS, COLOURED])
def test_pixels_of_cameras_that_do_not_expose_together_serve_every_variant(motion):
    cameras, rng = stereo(), np.random.default_rng(19)
    estimator = CatchPoseEstimator(9.81, DRAG, RIM_M, motion=motion)
    seen = sorted((t, i) for i in range(2) for t in stamps(0.8, 0.003 * i))
    seen[6:8] = seen[7], seen[6]  # one image arrives after a later one
    for t, i in seen:
        pixel = cameras[i].project(FLIGHT.position_m(START, VELOCITY, t))[0] + SIGMA_PX * rng.standard_normal(2)
        estimator.update_pixels(cameras[i], t, pixel, SIGMA_PX**2 * np.eye(2))
    pose = estimator.catch()
    assert np.linalg.norm(pose.position_m - CROSSING_M) < 4 * np.sqrt(np.trace(pose.covariance_m2))
    assert np.linalg.norm(pose.position_m - CROSSING_M) < 0.01
