import numpy as np

from kendama_cli.vision.cameras.triangulation import ray_constraints, triangulate
from tests.vision.scenes import stereo

POINT = np.array([0.12, 0.05, 0.31])
SIGMA_PX = 0.2


def sights(rng, sigma_px):
    return [
        ray_constraints(camera, camera.project(POINT)[0] + sigma_px * rng.standard_normal(2), SIGMA_PX**2 * np.eye(2))
        for camera in stereo()
    ]


def test_exact_pixels_give_the_exact_point():
    assert np.abs(triangulate(sights(np.random.default_rng(0), 0.0)).position_m - POINT).max() < 1e-9


def test_covariance_is_that_of_the_errors_and_longest_in_depth():
    """Mean of 1000 normalised squared errors of 3 numbers: 3 +- 0.08 (sigma)."""
    rng = np.random.default_rng(1)
    found = [triangulate(sights(rng, SIGMA_PX)) for _ in range(1000)]
    squares = [(f.position_m - POINT) @ np.linalg.solve(f.covariance_m2, f.position_m - POINT) for f in found]
    assert 2.7 < np.mean(squares) < 3.3
    sigma = np.sqrt(found[0].covariance_m2.diagonal())
    assert sigma[1] > 2 * sigma[0]
    assert sigma[1] > 2 * sigma[2]


def test_one_camera_alone_knows_no_point():
    assert triangulate(sights(np.random.default_rng(2), 0.0)[:1]) is None


def test_rays_that_meet_behind_the_cameras_give_no_point():
    left, right = stereo()
    crossed = [
        ray_constraints(left, left.project(POINT)[0] - [250.0, 0.0], 0.04 * np.eye(2)),
        ray_constraints(right, right.project(POINT)[0] + [250.0, 0.0], 0.04 * np.eye(2)),
    ]
    assert triangulate(crossed) is None
