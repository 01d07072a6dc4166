"""The estimator of a ball whose flight is disturbed: by a wobble of some colour, beside process noise."""

import numpy as np
import pytest

from kendama_cli.vision.cameras.triangulation import RayConstraints, ray_constraints
from kendama_cli.vision.prediction.ballistic import BallisticFit
from kendama_cli.vision.prediction.catch_pose import CatchPoseEstimator
from kendama_cli.vision.prediction.free_flight import FreeFlight
from kendama_cli.vision.prediction.kalman_flight import KalmanFlightFit
from kendama_cli.vision.settings import ColouredMotion
from tests.vision.scenes import stereo
from tests.vision.seen_flight import (
    CROSSING_S,
    DRAG,
    FLIGHT,
    RIM_M,
    START,
    VELOCITY,
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


def test_wobble_that_was_not_expected_shows_in_the_residuals_and_widens_the_covariance():
    points, _, _ = disturbed(COLOURED, np.random.default_rng(18))
    wrong, right = estimator_of(points, None), estimator_of(points, COLOURED)
    assert wrong.residual_ratio > 3
    assert 0.7 < right.residual_ratio < 1.3


def _positions(fit, times, points, sigma_m):
    for t, point in zip(times, points, strict=True):
        fit.add(t, RayConstraints(np.eye(3) / sigma_m, point / sigma_m, np.zeros(3), 1.0))


def _joint(motion, times, flight):
    """Covariance of position and velocity without the wobble, and of the wobble, at all ``times``, from the first on.

    Wide prior, white noise on the acceleration, and Matern's; all along one axis.
    """
    s = np.asarray(times) - times[0]
    least, most = np.minimum.outer(s, s), np.maximum.outer(s, s)
    first = s[:, None] <= s
    a, rate = flight.velocity_gain_s(s), 1 - flight.drag_per_s * flight.velocity_gain_s(s)
    q = motion.intensity_m2_s3
    place = 1.0 + 100.0 * np.outer(a, a) + q * least**2 * (3 * most - least) / 6
    # of the position at the row's time with the velocity at the column's
    mixed = 100.0 * np.outer(a, rate) + q * np.where(first, s[:, None] ** 2 / 2, least * (2 * most - least) / 2)
    speed = 100.0 * np.outer(rate, rate) + q * least
    d = np.sqrt(3) / motion.length_s * np.abs(np.subtract.outer(s, s))
    return place, mixed, speed, motion.sigma_m**2 * (1 + d) * np.exp(-d)


@pytest.mark.parametrize("of_marker", [False, True])
def test_state_covariance_and_likelihood_are_those_of_one_gaussian_over_all_times(of_marker):
    """Conditioned on all that was seen, which shares no code with the filter; without air the flight is linear."""
    flight, rng, sigma_m = FreeFlight(np.array([0.0, 0.0, -9.81]), 0.0), np.random.default_rng(21), 2e-3
    times = np.cumsum(rng.uniform(0.005, 0.02, 20))
    points = flight.position_m(START, VELOCITY, times - times[0]) + 2e-3 * rng.standard_normal((20, 3))
    likelihoods = []
    for motion in (ColouredMotion("coloured", 1.5, 4e-3, 0.1, 0.3), ColouredMotion("coloured", 0.7, 2e-3, 0.2, 1.0)):
        fit = KalmanFlightFit(flight, motion, of_marker=of_marker)
        _positions(fit, times, points, sigma_m)
        for ahead in (0.0, 0.15):
            place, mixed, speed, wobble = _joint(motion, [*times, times[-1] + ahead], flight)
            noise = (motion.noise_scale * sigma_m) ** 2 * np.eye(20)
            seen = (place + wobble)[:-1, :-1] + noise
            left = points - flight.position_m(START, VELOCITY, times - times[0])
            target = (place + wobble if of_marker else place)[-1]
            decay, since = np.sqrt(3) / motion.length_s, times[-1] + ahead - times
            rate = mixed[:-1, -1] - of_marker * (motion.sigma_m * decay) ** 2 * since * np.exp(-decay * since)
            gain = np.linalg.solve(seen, np.array([target[:-1], rate]).T).T
            true = flight.moved(START, VELOCITY, times[-1] + ahead - times[0])
            found, velocity = fit.state(times[-1] + ahead)
            variance = target[-1] - gain[0] @ target[:-1]
            assert found - true[0] == pytest.approx(gain[0] @ left, abs=0.02 * np.sqrt(variance))
            assert fit.ball_state(times[-1] + ahead).covariance_m2 == pytest.approx(
                variance * np.eye(3), rel=1e-3, abs=1e-9
            )
            spread = np.sqrt(speed[-1, -1] + of_marker * (motion.sigma_m * decay) ** 2 - gain[1] @ rate)
            assert velocity - true[1] == pytest.approx(gain[1] @ left, abs=0.02 * spread)
        square = np.sum(left * np.linalg.solve(seen, left))
        expected = -(square + 3 * np.linalg.slogdet(seen / sigma_m**2)[1]) / 2
        likelihoods.append((fit.log_likelihood, expected))
        assert fit.residual_ratio == pytest.approx(square / (60 - 6), rel=1e-2)
    assert likelihoods == pytest.approx(np.array(likelihoods)[:, [1, 1]], abs=0.05)


def test_stamps_that_go_back_change_nothing_of_an_undisturbed_flight():
    flight, motion = FreeFlight(np.array([0.0, 0.0, -9.81]), 0.3), ColouredMotion("coloured", 1.0, 1e-9, 0.1, 0.0)
    rng, times = np.random.default_rng(22), np.arange(20) / 100
    points = flight.position_m(START, VELOCITY, times) + 1e-3 * rng.standard_normal((20, 3))
    swapped, sorted_fit = (KalmanFlightFit(flight, motion) for _ in range(2))
    order = [0, 2, 1, 3, 5, 4, 7, 6, 8, 10, 9, 12, 11, 13, 15, 14, 17, 16, 19, 18]
    _positions(swapped, times[order], points[order], 1e-3)
    _positions(sorted_fit, times, points, 1e-3)
    for one, other in zip(swapped.state(0.3), sorted_fit.state(0.3), strict=True):
        assert one == pytest.approx(other, abs=1e-6)
    spreads = [fit.ball_state(0.3).covariance_m2 for fit in (swapped, sorted_fit)]
    assert spreads[0] == pytest.approx(spreads[1], rel=1e-4)
    assert swapped.reference_s == 0.19


def test_undisturbed_it_is_the_plain_fit_of_pixels_at_any_depth_with_their_noise_scaled():
    flight, cameras = FreeFlight(np.array([0.0, 0.0, -9.81]), 0.04, 0.1), stereo()
    plain, fit = BallisticFit(flight), KalmanFlightFit(flight, ColouredMotion("coloured", 2.0, 1e-9, 0.1, 0.0))
    for k, t in enumerate(np.arange(40) / 240):
        pixel = cameras[k % 2].project(flight.position_m(START, VELOCITY, t))[0]
        for one in (plain, fit):
            one.add(t, ray_constraints(cameras[k % 2], pixel, 0.04 * np.eye(2)))
    expected, found = plain.ball_state(0.3), fit.ball_state(0.3)
    assert found.position_m == pytest.approx(expected.position_m, abs=1e-5)
    assert found.velocity_m_s == pytest.approx(expected.velocity_m_s, abs=1e-4)
    sigma = np.sqrt(expected.covariance_m2.diagonal())
    scale = np.outer(sigma, sigma)
    assert found.covariance_m2 / scale / 4 == pytest.approx(expected.covariance_m2 / scale, abs=0.05)
