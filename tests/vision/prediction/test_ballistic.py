"""The information filter of a flight beside least squares on all of its pixels at once."""

import numpy as np
import pytest
from scipy.optimize import least_squares

from kendama_cli.vision.cameras.triangulation import ray_constraints
from kendama_cli.vision.prediction.ballistic import BallisticFit
from kendama_cli.vision.prediction.free_flight import FreeFlight
from tests.vision.scenes import stereo
from tests.vision.seen_flight import START, VELOCITY

G = np.array([0.2, -0.1, -9.81])


@pytest.mark.parametrize("noise", [2.0, 0.5])
@pytest.mark.parametrize(("drag_per_s", "drag_per_m"), [(0.0, 0.0), (0.4, 0.0), (0.04, 0.1)])
def test_state_covariance_and_residuals_are_those_of_least_squares_on_all_pixels(drag_per_s, drag_per_m, noise):
    """The noise is twice or half of what is stated; it is small, so that pixels are linear."""
    flight, rng, cameras = FreeFlight(G, drag_per_s, drag_per_m), np.random.default_rng(3), stereo()
    low = 2e-2 * np.array([[1.0, 0.0], [0.6, 1.2]])
    times = 5.0 + np.array([0.0, 0.004, 0.01, 0.013, 0.02, 0.024, 0.05, 0.06, 0.08, 0.1, 0.13, 0.15, 0.2])
    order = [0, *rng.permutation(np.arange(1, len(times)))]  # order is free after the first
    seen = [(times[i], cameras[i % 2]) for i in order]
    pixels = [
        one.project(flight.position_m(START, VELOCITY, t - 5.0))[0] + noise * low @ rng.normal(size=2)
        for t, one in seen
    ]
    fit = BallisticFit(flight)
    for (t, one), pixel in zip(seen, pixels, strict=True):
        fit.add(t, ray_constraints(one, pixel, low @ low.T))
        fit.within(1.0, 1.0)  # once the ball is known the sums go on alone

    def off(start):
        rows = [
            one.project(flight.position_m(start[:3], start[3:], t - 5.0))[0] - pixel
            for (t, one), pixel in zip(seen, pixels, strict=True)
        ]
        return np.linalg.solve(low, np.array(rows).T).ravel()

    best = least_squares(off, [*START, *VELOCITY], jac="3-point", xtol=1e-15, ftol=1e-15, gtol=1e-15)
    ratio = 2 * best.cost / (2 * len(seen) - 6)
    assert fit.count == 2 * len(seen)
    assert fit.reference_s == 5.0
    assert fit._early is None
    assert fit.residual_ratio == pytest.approx(ratio, rel=0.02)
    covariance, h = np.linalg.inv(best.jac.T @ best.jac) * max(ratio, 1.0), 1e-5
    for t in (5.0, 5.3):

        def state(start, t=t):
            return np.concatenate(flight.moved(start[:3], start[3:], t - 5.0))

        slope = np.array([(state(best.x + h * e) - state(best.x - h * e)) / (2 * h) for e in np.eye(6)]).T
        expected = slope @ covariance @ slope.T
        sigma = np.sqrt(expected.diagonal())
        assert np.abs(np.concatenate(fit.state(t)) - state(best.x)) == pytest.approx(np.zeros(6), abs=0.1 * sigma.max())
        ball = fit.ball_state(t)
        scale = np.outer(sigma[:3], sigma[:3])
        assert ball.covariance_m2 / scale == pytest.approx(expected[:3, :3] / scale, abs=0.03)
        assert np.abs(ball.position_m - state(best.x)[:3]).max() < 0.1 * sigma[:3].min()


def test_what_is_seen_too_little_is_not_known_and_small_residuals_do_not_shrink_the_covariance():
    flight, cameras = FreeFlight(G, 0.0), stereo()
    fit = BallisticFit(flight)
    for k, t in enumerate(np.arange(12) / 60):
        if k < 3:
            assert fit.state(t) is None
            assert fit.ball_state(t) is None
            assert not fit.within(1e9, 1e9)
        pixel = cameras[k % 2].project(flight.position_m(START, VELOCITY, t))[0]
        fit.add(t, ray_constraints(cameras[k % 2], pixel, 0.04 * np.eye(2)))
    assert fit.residual_ratio < 1e-3
    assert fit.within(0.005, 0.05)
    assert not fit.within(1e-6, 0.05)
    assert not fit.within(0.005, 1e-6)
    assert np.abs(np.concatenate(fit.state(0.1)) - np.concatenate(flight.moved(START, VELOCITY, 0.1))).max() < 1e-6
