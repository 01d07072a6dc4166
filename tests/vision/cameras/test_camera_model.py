import cv2
import numpy as np
import pytest

from kendama_cli.vision.cameras.camera_model import CameraModel, looking_at
from tests.vision.scenes import shipped_models, stereo


def points_in_view(rng, n=200):
    return rng.uniform([-0.4, -0.4, -0.1], [0.4, 0.6, 0.5], size=(n, 3))


def test_projection_agrees_with_opencv_to_machine_precision():
    points = points_in_view(np.random.default_rng(0))
    for camera in shipped_models():
        rotation, _ = cv2.Rodrigues(camera.world_to_camera)
        offset = -camera.world_to_camera @ camera.position_in_world_m
        theirs, _ = cv2.projectPoints(points, rotation, offset, camera.optics.matrix, camera.distortion)
        assert np.abs(camera.project(points) - theirs.reshape(-1, 2)).max() < 1e-9


def test_undistortion_undoes_projection():
    points = points_in_view(np.random.default_rng(1))
    for camera in shipped_models():
        c = (points - camera.position_in_world_m) @ camera.world_to_camera.T
        flat = camera.undistort(camera.project(points))
        assert np.abs(flat - c[:, :2] / c[:, 2:]).max() < 1e-9


def test_a_ray_through_a_points_pixel_meets_the_point():
    points = points_in_view(np.random.default_rng(2))
    camera = shipped_models()[0]
    rays = camera.rays(camera.project(points))
    meeting = camera.position_in_world_m + camera.depth_m(points)[:, None] * rays
    assert np.abs(meeting - points).max() < 1e-8


def test_the_slope_of_the_distortion_is_the_derivative_of_the_projection():
    camera = stereo(distortion=(-0.2, 0.07, 0.003, -0.002, 0.01))[0]
    flat, h = np.array([0.31, -0.22]), 1e-6

    def pixel(xy):
        world = camera.position_in_world_m + np.array([xy[0], xy[1], 1.0]) @ camera.world_to_camera
        return camera.project(world)[0]

    numeric = np.column_stack([(pixel(flat + h * e) - pixel(flat - h * e)) / (2 * h) for e in np.eye(2)])
    at = camera.straight(*pixel(flat))
    assert np.allclose([[at.u_x, at.u_y], [at.v_x, at.v_y]], numeric, rtol=1e-6, atol=1e-6)


def test_a_point_behind_the_camera_has_no_pixel():
    camera = stereo()[0]
    behind = camera.position_in_world_m - camera.world_to_camera[2]
    assert np.isnan(camera.project(behind)).all()


def test_a_level_camera_sees_up_as_up_and_cannot_look_straight_down():
    camera = stereo()[0]
    low, high = camera.project([[0.0, 0.0, 0.1], [0.0, 0.0, 0.3]])
    assert high[1] < low[1]
    with pytest.raises(ValueError, match="straight up or down"):
        looking_at((0, 0, 1), (0, 0, 0))


def test_a_mirrored_pose_is_refused():
    camera = stereo()[0]
    with pytest.raises(ValueError, match="'left': world_to_camera is not a rotation"):
        CameraModel(
            "left", 640, 480, camera.focal_px, camera.center_px, camera.distortion,
            np.diag([1.0, 1.0, -1.0]) @ camera.world_to_camera, camera.position_in_world_m,
        )  # fmt: skip


def test_one_pixel_alone_is_undistorted_as_opencv_does_all():
    camera, rng = stereo((-0.2, 0.05, 0.001, -0.002, 0.01))[0], np.random.default_rng(8)
    for u, v in rng.uniform([0, 0], [640, 480], (50, 2)):
        at = camera.straight(u, v)
        assert np.allclose((at.x, at.y), camera.undistort((u, v))[0], atol=1e-9)


def test_where_newton_fails_opencvs_fixed_point_steps_in():
    """A model that folds over within the image: no exception, and the same answer as OpenCV's."""
    camera = stereo((-1.5, 0.0, 0.0, 0.0, 0.0))[0]
    at = camera.straight(2.0, 3.0)
    assert np.allclose((at.x, at.y), camera.undistort((2.0, 3.0))[0])
