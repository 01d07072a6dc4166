"""Wide cameras calibrated from views of a board, beside the null of calling their lenses radial."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from kendama_cli.vision.calibration import BoardView, CalibratedCamera, calibrate
from tests.vision.fisheye_views import BOARD, SIZE, off_mm, pair, views_of


def calibrated(views: dict[str, list[BoardView]], lens: str) -> list[CalibratedCamera]:
    return calibrate(BOARD, views, dict.fromkeys(views, SIZE), np.zeros(3), lens)


def test_distances_between_wide_cameras_are_right_where_a_radial_lens_is_not():
    """0.2 px of noise along each axis, 12 views each: the corners leave 0.28 px."""
    errors = []
    for seed in (10631, 10632):
        rng = np.random.default_rng(seed)
        true = pair(rng, "fisheye")
        views = views_of(true, rng, 12)
        found, null = calibrated(views, "fisheye"), calibrated(views, "radial")
        errors.append((off_mm([one.model for one in found], true), off_mm([one.model for one in null], true)))
        for one, camera in zip(found, true, strict=True):
            assert one.model.lens == "fisheye"
            assert 0.2 < one.rms_px < 0.3
            assert (np.abs(one.model.focal_px - camera.focal_px) < 4 * one.sigma_px[:2]).all()
            assert one.model.focal_px[0] == pytest.approx(camera.focal_px[0], rel=0.01)
    wide, null = np.mean(np.array(errors), axis=0)
    assert wide < 0.5
    assert null > 2 * wide


def test_a_board_that_reaches_behind_the_camera_at_the_edge_of_its_view_is_a_view_like_others():
    rng = np.random.default_rng(10633)
    camera = pair(rng, "fisheye")[0]
    views = views_of([camera], rng, 8)
    turn = cv2.Rodrigues(np.array([0.0, -np.pi / 3, 0.0]))[0]  # its rows go away from the camera
    in_camera_m = BOARD.corners_m @ turn.T + [-0.1, -0.12, -0.02]
    pixels = camera.project(in_camera_m @ camera.world_to_camera + camera.position_in_world_m)
    ids = np.flatnonzero(((pixels > 0) & (pixels < SIZE)).all(axis=1))
    assert in_camera_m[ids, 2].min() > 0.03
    assert len(ids) > 20
    views["left"].append(BoardView("edge", ids, pixels[ids] + rng.normal(0, 0.2, (len(ids), 2))))
    (found,) = calibrated(views, "fisheye")
    assert found.errors_px[-1] < 0.5
    assert found.model.focal_px == pytest.approx(camera.focal_px, rel=0.01)


def test_a_view_whose_corners_are_named_wrongly_is_refused_and_named():
    rng = np.random.default_rng(10634)
    views = views_of(pair(rng, "fisheye")[:1], rng, 10)
    wrong = views["left"][5]
    views["left"][5] = BoardView(wrong.name, np.roll(wrong.ids, 1), wrong.pixels)
    with pytest.raises(ValueError, match=f"camera 'left': view '{wrong.name}' is off by"):
        calibrated(views, "fisheye")


def test_views_of_no_flat_board_are_refused():
    rng = np.random.default_rng(10635)
    views = views_of(pair(rng, "fisheye")[:1], rng, 6)
    for view in views["left"]:
        rng.shuffle(view.pixels)
    with pytest.raises(ValueError, match="camera 'left'"):
        calibrated(views, "fisheye")
