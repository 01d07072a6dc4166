"""The lens beside OpenCV and beside the cone of rays that touch a sphere."""

import cv2
import numpy as np
import pytest

from kendama_cli.vision.cameras.radial_lens import RadialLens

LENSES = [
    RadialLens(600.0, 610.0, 319.5, 250.5, -0.2, 0.07, 0.003, -0.002, 0.01),
    RadialLens(450.0, 440.0, 300.0, 240.0, 0.15, -0.05, -0.002, 0.004, 0.02),
]


def _pixel(lens, x, y):
    found = cv2.projectPoints(np.array([[x, y, 1.0]]), np.zeros(3), np.zeros(3), lens.matrix, lens.distortion)
    return found[0].ravel()


def _slopes(lens, x, y, h=1e-6):
    return np.array(
        [_pixel(lens, x + h, y) - _pixel(lens, x - h, y), _pixel(lens, x, y + h) - _pixel(lens, x, y - h)]
    ).T / (2 * h)


@pytest.mark.parametrize("lens", LENSES)
def test_one_pixel_is_straight_where_opencv_projects_it_from_and_its_slope_is_that_of_the_projection(lens, monkeypatch):
    """Newton's method alone, in ten steps at most."""
    monkeypatch.setattr(RadialLens, "undistort", lambda self, pixels: pytest.fail("OpenCV was asked"))
    rng, left = np.random.default_rng(1), []
    for x, y in rng.uniform(-0.45, 0.45, (60, 2)):
        at = lens.straight(*_pixel(lens, x, y))
        left.append(np.hypot(at.x - x, at.y - y))
        assert np.array([[at.u_x, at.u_y], [at.v_x, at.v_y]]) == pytest.approx(_slopes(lens, x, y), rel=1e-6, abs=1e-4)
    assert max(left) < 1e-9
    assert np.median(left) < 1e-12, "the last of Newton's steps squares what is left before it"
    whole = lens.matrix @ [0.2, -0.3, 1.0]
    assert whole == pytest.approx([lens.cx + 0.2 * lens.fx, lens.cy - 0.3 * lens.fy, 1.0])


def test_where_the_lens_folds_over_slopes_are_those_at_the_point_that_opencv_finds():
    lens = RadialLens(600.0, 620.0, 319.5, 239.5, -1.5, 0.0, 0.002, -0.003)
    at = lens.straight(2.0, 3.0)
    assert (at.x, at.y) == pytest.approx(lens.undistort(np.array([[2.0, 3.0]]))[0])
    expected = _slopes(lens, at.x, at.y)
    assert np.array([[at.u_x, at.u_y], [at.v_x, at.v_y]]) == pytest.approx(expected, rel=1e-5, abs=1e-3)


def test_a_sphere_s_centre_lies_off_its_disc_s_as_the_cone_about_it_is_cut():
    """The disc, in the plane of the axis, reaches from tan(theta - alpha) to tan(theta + alpha)."""
    lens = RadialLens(500.0, 500.0, 320.0, 240.0, 0.0, 0.0, 0.0, 0.0)
    for theta, alpha, turn in ((0.4, 0.05, 0.3), (0.6, 0.02, 2.0), (0.1, 0.1, -1.0)):
        way = 500.0 * np.array([np.cos(turn), np.sin(turn)])
        disc = lens.center_px + way * (np.tan(theta + alpha) + np.tan(theta - alpha)) / 2
        found = lens.sphere_centre(disc, 500.0 * np.sin(alpha) / np.cos(theta))
        assert found == pytest.approx(lens.center_px + way * np.tan(theta), abs=1e-9)
        assert lens.size_px(np.array([0.3, 0.2, 2.0]), 0.02) == pytest.approx(5.0)


def test_points_have_pixels_in_front_of_the_camera_alone_and_those_are_opencv_s_at_any_pose():
    lens, rng = LENSES[0], np.random.default_rng(2)
    points, rotation, shift = rng.normal(0, 0.3, (20, 3)), np.array([0.2, -0.1, 0.3]), np.array([0.1, 0.2, 1.5])
    pixels, slopes = lens.posed(points, rotation, shift)
    moved = points @ cv2.Rodrigues(rotation)[0].T + shift
    assert lens.project(moved) == pytest.approx(pixels, abs=1e-9)
    for k, step in enumerate(1e-6 * np.eye(6)):  # pose, then the lens: fx, fy, cx, cy, k1, k2, p1, p2
        sides = [lens.posed(points, rotation + one[:3], shift + one[3:])[0] for one in (step, -step)]
        assert slopes[:, k] == pytest.approx((sides[0] - sides[1]).ravel() / 2e-6, rel=1e-4, abs=1e-2)
    assert slopes.shape == (40, 14)
    assert np.isnan(lens.project(moved * [1, 1, -1])).all()
    assert lens.project(np.array([[1e-7, 0.0, 2e-6]])).any()
    assert lens.coarsest_px == 600.0
    plain = RadialLens(600.0, 610.0, 319.5, 250.5, 0.0, 0.0, 0.0, 0.0)
    assert plain.undistort(plain.project(moved)) == pytest.approx(moved[:, :2] / moved[:, 2:], abs=1e-12)
