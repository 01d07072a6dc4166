import dataclasses

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


def test_rows_are_exposed_one_after_another_about_the_frame_s_time_and_a_carried_camera_sees_as_its_link_moves():
    camera = dataclasses.replace(stereo()[0], readout_s=0.024)
    found = camera.exposed_s([1.0, 2.0, 3.0], [[5.0, 0.0], [9.0, 239.5], [7.0, 479.0]])
    assert found == pytest.approx([1.0 - 239.5 * 50e-6, 2.0, 3.0 + 239.5 * 50e-6])  # 24 ms over 480 rows
    turn, shift = cv2.Rodrigues(np.array([0.3, -0.2, 0.5]))[0], np.array([0.4, -0.1, 0.2])
    points = points_in_view(np.random.default_rng(9), 20)
    carried = dataclasses.replace(camera, link="tool").carried(turn, shift)
    assert carried.link is None
    assert carried.project(points @ turn.T + shift) == pytest.approx(camera.project(points), abs=1e-6)
    assert carried.depth_m(points @ turn.T + shift) == pytest.approx(camera.depth_m(points))
    at = points[0] @ turn.T + shift
    assert carried.size_px(at, 0.02) == pytest.approx(600 * 0.02 / camera.depth_m(points[:1])[0])
