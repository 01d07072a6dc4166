import dataclasses

import numpy as np
import pytest
from scipy.optimize import least_squares

from kendama_cli.vision.cameras.camera_model import looking_at
from kendama_cli.vision.cameras.triangulation import ray_constraints, triangulate
from tests.vision.scenes import stereo

POINT = np.array([0.12, 0.05, 0.31])
SIGMA_PX = 0.2


def sights(rng, sigma_px):
    return [
        ray_constraints(camera, camera.project(POINT)[0] + sigma_px * rng.standard_normal(2), SIGMA_PX**2 * np.eye(2))
        for camera in stereo()
    ]


def test_one_camera_alone_knows_no_point():
    assert triangulate(sights(np.random.default_rng(2), 0.0)[:1]) is None


def test_rays_that_meet_behind_the_cameras_give_no_point():
    left, right = stereo()
    crossed = [
        ray_constraints(left, left.project(POINT)[0] - [250.0, 0.0], 0.04 * np.eye(2)),
        ray_constraints(right, right.project(POINT)[0] + [250.0, 0.0], 0.04 * np.eye(2)),
    ]
    assert triangulate(crossed) is None


def test_a_point_is_that_of_least_squares_on_the_pixels_with_their_correlated_noise():
    """Three cameras at different distances; the noise is so small that pixels are linear in the point."""
    rng, position = np.random.default_rng(3), np.array([0.5, -0.9, 0.6])
    cameras = [*stereo((-0.2, 0.07, 0.003, -0.002, 0.01))]
    cameras.append(
        dataclasses.replace(cameras[0], world_to_camera=looking_at(position, POINT), position_in_world_m=position)
    )
    for _ in range(20):
        factors = [1e-3 * np.array([[rng.uniform(1, 3), 0], [rng.normal(0, 2), rng.uniform(0.5, 2)]]) for _ in cameras]
        seen = [one.project(POINT)[0] + low @ rng.normal(size=2) for one, low in zip(cameras, factors, strict=True)]

        def off(point, seen=seen, factors=factors):
            rows = zip(cameras, seen, factors, strict=True)
            return np.concatenate([np.linalg.solve(low, one.project(point)[0] - at) for one, at, low in rows])

        best = least_squares(off, POINT, jac="3-point", xtol=1e-15, ftol=1e-15, gtol=1e-15)
        covariance = np.linalg.inv(best.jac.T @ best.jac)
        rows = zip(cameras, seen, factors, strict=True)
        found = triangulate([ray_constraints(one, at, low @ low.T) for one, at, low in rows])
        sigma = np.sqrt(covariance.diagonal())
        assert np.abs(found.position_m - best.x).max() < 0.02 * sigma.min()
        assert found.covariance_m2 / np.outer(sigma, sigma) == pytest.approx(
            covariance / np.outer(sigma, sigma), abs=1e-3
        )
        assert found.chi_square == pytest.approx(2 * best.cost / 3, rel=1e-2)
