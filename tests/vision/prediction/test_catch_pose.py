"""The estimator against the Cramer-Rao bound, and what it says when it cannot know."""

import dataclasses

import numpy as np
import pytest

from kendama_cli.vision.prediction.catch_pose import CatchPoseEstimator, opening_against
from kendama_cli.vision.prediction.free_flight import FreeFlight, tilted_gravity
from tests.vision.scenes import stereo
from tests.vision.seen_flight import (
    CROSSING_M,
    CROSSING_S,
    DRAG,
    FLIGHT,
    RATE_HZ,
    RIM_M,
    SIGMA_PX,
    START,
    VELOCITY,
    stamps,
)


def predicted(cameras, fraction, rng, *, offsets=(0.0, 0.0), sigma_px=SIGMA_PX, estimator=None):
    estimator = estimator or CatchPoseEstimator(9.81, DRAG, RIM_M)
    for camera, offset in zip(cameras, offsets, strict=True):
        t = stamps(fraction, offset)
        pixels = camera.project(FLIGHT.position_m(START, VELOCITY, t)) + sigma_px * rng.standard_normal((len(t), 2))
        for moment, pixel in zip(t, pixels, strict=True):
            estimator.update_pixels(camera, moment, pixel, SIGMA_PX**2 * np.eye(2))
    return estimator


def cramer_rao(cameras, fraction):
    """Bound on (x, y, t) of the crossing, from numerical derivatives of the projection alone: no code in common."""
    state, information = np.concatenate([START, VELOCITY]), np.zeros((6, 6))
    t = stamps(fraction)

    def pixels(camera, state):
        return camera.project(FLIGHT.position_m(state[:3], state[3:], t)).ravel()

    def crossing(state):
        s = FLIGHT.descent_s(state[:3], state[3:], RIM_M)
        return np.append(FLIGHT.position_m(state[:3], state[3:], s)[:2], s)

    h = 1e-5
    for camera in cameras:
        j = np.column_stack(
            [(pixels(camera, state + h * e) - pixels(camera, state - h * e)) / (2 * h) for e in np.eye(6)]
        )
        information += j.T @ j / SIGMA_PX**2
    g = np.column_stack([(crossing(state + h * e) - crossing(state - h * e)) / (2 * h) for e in np.eye(6)])
    return g @ np.linalg.inv(information) @ g.T


def against_the_bound(fraction, draws):
    """rms error over the Cramer-Rao bound, in position and in time."""
    cameras, rng = stereo(), np.random.default_rng(3)
    poses = [predicted(cameras, fraction, rng).catch() for _ in range(draws)]
    errors = np.array([[*(pose.position_m - CROSSING_M)[:2], pose.t_s - CROSSING_S] for pose in poses])
    bound = cramer_rao(cameras, fraction)
    return np.sqrt(
        [(errors[:, :2] ** 2).sum(axis=1).mean() / np.trace(bound[:2, :2]), (errors[:, 2] ** 2).mean() / bound[2, 2]]
    )


@pytest.mark.parametrize("fraction", [0.3, 0.9])
def test_error_reaches_the_cramer_rao_bound_in_position_and_time(fraction):
    """200 draws: the rms of 200 values scatters by 5 %, so 0.85..1.15 are three standard deviations."""
    assert (np.abs(against_the_bound(fraction, 200) - 1) < 0.15).all()


@pytest.mark.slow
@pytest.mark.parametrize("fraction", [0.3, 0.5, 0.7, 0.9])
def test_two_thousand_draws_stay_within_five_percent_of_the_bound(fraction):
    """The rms of 2000 values scatters by 1.6 %; measured 0.98..1.02."""
    assert (against_the_bound(fraction, 2000) <= 1.05).all()


def test_stated_covariance_is_the_true_one():
    """Mean of 300 normalised squared errors of 2 numbers: 2 +- 0.12; the covariance is scaled up, never down."""
    cameras, rng = stereo(), np.random.default_rng(4)
    squares = []
    for _ in range(300):
        pose = predicted(cameras, 0.5, rng).catch()
        error = (pose.position_m - CROSSING_M)[:2]
        squares.append(error @ np.linalg.solve(pose.covariance_m2[:2, :2], error))
    assert 1.4 < np.mean(squares) < 2.36


def test_without_noise_the_crossing_is_exact():
    pose = predicted(stereo(), 0.4, np.random.default_rng(0), sigma_px=0.0).catch()
    assert np.abs(pose.position_m - CROSSING_M).max() < 1e-7
    assert abs(pose.t_s - CROSSING_S) < 1e-8


def test_cameras_need_not_expose_together():
    together = predicted(stereo(), 0.5, np.random.default_rng(5)).catch()
    apart = predicted(stereo(), 0.5, np.random.default_rng(5), offsets=(0.0, 0.0047)).catch()
    assert np.linalg.norm(apart.position_m - CROSSING_M) < 4 * np.sqrt(np.trace(apart.covariance_m2))
    assert np.trace(apart.covariance_m2) < 2 * np.trace(together.covariance_m2)


def test_marker_positions_give_the_pose_as_least_squares_would():
    rng, sigma = np.random.default_rng(6), 1e-3
    t = stamps(0.5)
    seen = FLIGHT.position_m(START, VELOCITY, t) + sigma * rng.standard_normal((len(t), 3))
    estimator = CatchPoseEstimator(np.array([0.0, 0.0, -9.81]), DRAG, RIM_M)
    for moment, point in zip(t, seen, strict=True):
        estimator.update_position(moment, point, sigma**2 * np.eye(3))
    a = FLIGHT.velocity_gain_s(t)
    design = np.column_stack([np.ones_like(t), a])
    fall = FLIGHT.gravity_gain_s2(t)[:, None] * FLIGHT.gravity_m_s2
    expected = np.linalg.lstsq(design, seen - fall, rcond=None)[0]
    assert np.allclose(estimator.state_at(0.0), expected.ravel(), atol=1e-9)
    assert np.linalg.norm(estimator.catch().position_m - CROSSING_M) < 6e-3


def test_pixels_and_markers_mix():
    estimator = predicted(stereo(), 0.2, np.random.default_rng(7))
    before = np.trace(estimator.catch().covariance_m2)
    point = FLIGHT.position_m(START, VELOCITY, 0.15)
    estimator.update_position(0.15, point, 1e-8 * np.eye(3))
    assert np.trace(estimator.catch().covariance_m2) < before


def test_more_of_the_flight_means_a_smaller_covariance():
    sizes = [np.trace(predicted(stereo(), f, np.random.default_rng(8)).catch().covariance_m2) for f in (0.3, 0.5, 0.9)]
    assert sizes[0] > 2 * sizes[1] > 4 * sizes[2]


def test_too_little_seen_gives_no_pose():
    estimator = CatchPoseEstimator(9.81, DRAG, RIM_M)
    assert estimator.catch() is None
    left = stereo()[0]
    for t in stamps(0.5)[:2]:
        estimator.update_pixels(left, t, left.project(FLIGHT.position_m(START, VELOCITY, t))[0], 0.04 * np.eye(2))
    assert estimator.catch() is None


def test_a_poor_detector_s_first_images_do_not_carry_the_ball_away():
    """Two images with 1.5 px of noise give up to 1e4 m/s, at which quadratic drag and depths are nonsense."""
    cameras, rng = stereo(), np.random.default_rng(21)
    for _ in range(30):
        estimator = CatchPoseEstimator(9.81, DRAG, RIM_M, drag_per_m=0.2)
        for t in stamps(0.5):
            for camera in cameras:
                pixel = camera.project(FLIGHT.position_m(START, VELOCITY, t))[0] + 1.5 * rng.standard_normal(2)
                estimator.update_pixels(camera, t, pixel, 1.5**2 * np.eye(2))
                estimator.catch()
        assert np.linalg.norm(estimator.state_at(0.0)[:3] - START) < 0.1


def test_a_flight_that_stays_below_the_rim_gives_no_pose():
    assert predicted(stereo(), 0.5, np.random.default_rng(9)).catch(rim_height_m=1.0) is None


def test_reset_forgets_the_flight():
    estimator = predicted(stereo(), 0.5, np.random.default_rng(10))
    estimator.reset()
    assert estimator.n_observations == 0
    assert estimator.catch() is None
    fresh = predicted(stereo(), 0.5, np.random.default_rng(11)).catch()
    again = predicted(stereo(), 0.5, np.random.default_rng(11), estimator=estimator).catch()
    assert np.array_equal(fresh.position_m, again.position_m)


def test_a_wrong_calibration_shows_in_the_residuals_and_widens_the_covariance():
    cameras = stereo()
    honest = predicted(cameras, 0.9, np.random.default_rng(12))
    pitch = np.deg2rad(0.1)  # the right camera, a tenth of a degree off: one pixel
    turn = np.array([[1, 0, 0], [0, np.cos(pitch), -np.sin(pitch)], [0, np.sin(pitch), np.cos(pitch)]])
    believed = [cameras[0], dataclasses.replace(cameras[1], world_to_camera=turn @ cameras[1].world_to_camera)]
    wrong, rng = CatchPoseEstimator(9.81, DRAG, RIM_M), np.random.default_rng(12)
    for seen, model in zip(cameras, believed, strict=True):
        for t in stamps(0.9):
            pixel = seen.project(FLIGHT.position_m(START, VELOCITY, t))[0] + SIGMA_PX * rng.standard_normal(2)
            wrong.update_pixels(model, t, pixel, SIGMA_PX**2 * np.eye(2))
    assert 0.6 < honest.residual_ratio < 1.4
    assert wrong.residual_ratio > 1.6
    assert np.trace(wrong.catch().covariance_m2) > 1.5 * np.trace(honest.catch().covariance_m2)


def test_the_cup_opens_against_the_relative_velocity():
    pose = predicted(stereo(), 0.5, np.random.default_rng(13)).catch()
    w, x, y, z = pose.rotation_wxyz
    axis = np.array([2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)])
    assert np.allclose(axis, -pose.velocity_m_s / np.linalg.norm(pose.velocity_m_s), atol=1e-12)
    assert np.isclose(np.linalg.norm(pose.rotation_wxyz), 1.0)
    assert np.array_equal(opening_against([0.0, 0.0, 0.0]), [1, 0, 0, 0])
    assert np.array_equal(opening_against([0.0, 0.0, 3.0]), [1, 0, 0, 0])
    assert np.allclose(opening_against([0.0, 0.0, -3.0]), [1, 0, 0, 0])


def test_the_same_observations_give_the_same_bytes():
    first, second = (predicted(stereo(), 0.5, np.random.default_rng(14)).catch() for _ in range(2))
    assert first.position_m.tobytes() == second.position_m.tobytes()
    assert first.t_s == second.t_s


def test_an_observation_costs_the_same_however_many_came_before():
    """Asked after every frame, only sums are kept; they give what all sights together, asked once, would."""
    cameras, each, once = stereo(), CatchPoseEstimator(9.81, DRAG, RIM_M), CatchPoseEstimator(9.81, DRAG, RIM_M)
    rng = np.random.default_rng(15)
    for t in stamps(0.9):
        for camera in cameras:
            pixel = camera.project(FLIGHT.position_m(START, VELOCITY, t))[0] + SIGMA_PX * rng.standard_normal(2)
            each.update_pixels(camera, t, pixel, SIGMA_PX**2 * np.eye(2))
            once.update_pixels(camera, t, pixel, SIGMA_PX**2 * np.eye(2))
        each.catch()
    assert each._fit._early is None
    assert each._fit._sums.shape == (7, 7)
    sigma = np.sqrt(np.trace(once.catch().covariance_m2))
    assert np.linalg.norm(once.catch().position_m - each.catch().position_m) < 0.03 * sigma


def test_a_tilted_calibration_of_gravity_is_taken_out():
    tilt = np.array([0.01, -0.007])
    gravity = tilted_gravity(9.9, tilt)
    assert np.linalg.norm(gravity) == pytest.approx(9.9)
    assert np.allclose(np.arctan2(gravity[:2], -gravity[2]), tilt)
    true, t = FreeFlight(gravity, DRAG), np.arange(0.0, 0.15, 1 / RATE_HZ)
    end = true.position_m(START, VELOCITY, true.descent_s(START, VELOCITY, RIM_M))

    def error(believed):
        estimator = CatchPoseEstimator(believed, DRAG, RIM_M)
        for moment in t:
            estimator.update_position(moment, true.position_m(START, VELOCITY, moment), 1e-6 * np.eye(3))
        return np.linalg.norm(estimator.catch().position_m - end)

    assert error(gravity) < 1e-7
    assert error(9.81) > 2e-3
