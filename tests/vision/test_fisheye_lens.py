"""The fisheye lens against OpenCV's, against differences, and at the end of what it sees."""

from __future__ import annotations

import dataclasses

import cv2
import numpy as np
import pytest

from kendama_cli.vision.ball_film import FilmTrack
from kendama_cli.vision.film_positions import from_one, from_several
from kendama_cli.vision.kannala_brandt import LEAST_STEEP, WIDEST_DEG
from kendama_cli.vision.lens import Lens
from kendama_cli.vision.marker_pose import CORNERS, marker_poses
from kendama_cli.vision.radial_lens import RadialLens
from kendama_cli.vision.tracker import sphere_centre
from kendama_cli.vision.triangulation import sight_rows, triangulate
from tests.vision.fisheye_views import SIZE, WIDE, wide

LENS = wide().optics
K, D = wide().matrix, np.array(WIDE[:4])
COLUMNS, ROWS = np.meshgrid(np.arange(SIZE[0]), np.arange(SIZE[1]))
PIXELS = np.column_stack([COLUMNS.ravel(), ROWS.ravel()]).astype(np.float64)


def directions(rng, n, most_deg=88.5):
    theta, phi = rng.uniform(0, np.radians(most_deg), n), rng.uniform(0, 2 * np.pi, n)
    return np.column_stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)])


def opencv(points):
    return cv2.fisheye.projectPoints(points.reshape(-1, 1, 3), np.zeros(3), np.zeros(3), K, D)[0].reshape(-1, 2)


def slope(function, at, step=1e-6):
    return np.column_stack([(function(at + step * e) - function(at - step * e)) / (2 * step) for e in np.eye(len(at))])


def test_projection_is_opencvs_up_to_the_edge():
    rng = np.random.default_rng(10622)
    points = rng.uniform(0.2, 3, (2000, 1)) * directions(rng, 2000)
    assert np.abs(LENS.project(points) - opencv(points)).max() < 1e-9


def test_every_pixel_that_sees_comes_back_by_opencvs_projection_and_the_others_see_nothing():
    flat, seen = LENS.undistort(PIXELS), LENS.sees(PIXELS)
    assert 0 < np.count_nonzero(~seen) < 200, "the image's corners"
    assert np.isnan(flat[~seen]).all()
    assert np.abs(opencv(np.column_stack([flat, np.ones(len(flat))])[seen]) - PIXELS[seen]).max() < 1e-6
    theirs = cv2.fisheye.undistortPoints(PIXELS[seen].reshape(-1, 1, 2), K, D, criteria=(3, 100, 1e-14)).reshape(-1, 2)
    assert np.abs(np.arctan(theirs) - np.arctan(flat[seen])).max() < 1e-9


def test_a_point_beyond_the_edge_or_behind_has_no_pixel_where_opencv_gives_a_wrong_one():
    for degrees in (WIDEST_DEG + 0.5, 90.0, 120.0, 180.0):
        point = np.array([[np.sin(np.radians(degrees)), 0.0, np.cos(np.radians(degrees))]])
        assert np.isnan(LENS.project(point)).all()
    behind = np.array([[0.2, 0.1, -1.0]])
    assert np.isfinite(opencv(behind)).all()
    assert np.isfinite(LENS.project(np.array([[0.0, np.sin(1.55), np.cos(1.55)]]))).all()


def test_a_model_that_folds_over_sees_no_farther_than_where_it_is_steep():
    lens = wide(numbers=(-0.15, 0.0, 0.0, 0.0, 0.0)).optics
    assert 1 - 0.45 * lens.widest_rad**2 == pytest.approx(LEAST_STEEP)
    beyond = lens.widest_rad + 0.01
    assert np.isnan(lens.project(np.array([[np.sin(beyond), 0.0, np.cos(beyond)]]))).all()
    assert not lens.sees(np.array([[0.0, 0.0]])).any()


def test_one_pixel_alone_is_undistorted_as_all_are_and_has_the_slope_of_the_projection():
    for u, v in [(318.0, 241.0), (318.0 + 1e-5, 241.0), (330.0, 200.0), (601.0, 250.0), (40.0, 60.0)]:
        at = LENS.straight(u, v)
        assert np.allclose((at.x, at.y), LENS.undistort(np.array([[u, v]]))[0], rtol=1e-12)
        numeric = slope(lambda xy: LENS.project(np.array([[*xy, 1.0]]))[0], np.array([at.x, at.y]))
        assert np.allclose([[at.u_x, at.u_y], [at.v_x, at.v_y]], numeric, atol=1e-6)
    assert np.isnan(LENS.straight(0.0, 0.0)).all()


@pytest.mark.parametrize(
    "lens", [LENS, RadialLens(600.0, 602.0, 320.0, 239.0, -0.1, 0.05, 0.001, -0.002)], ids=["fisheye", "radial"]
)
def test_slopes_by_pose_and_lens_are_those_of_differences(lens: Lens):
    rng = np.random.default_rng(10623)
    points = rng.uniform(-0.2, 0.2, (12, 3)) * [1, 1, 0]
    depth = 1.2 if isinstance(lens, RadialLens) else 0.35
    at = np.array([0.4, -0.3, 0.2, 0.1, -0.2, depth, *dataclasses.astuple(lens)[:8]])

    def pixels(values):
        return type(lens)(*values[6:]).posed(points, values[:3], values[3:6])[0].ravel()

    numeric = slope(pixels, at)
    assert np.allclose(lens.posed(points, at[:3], at[3:6])[1], numeric, atol=1e-8 * np.abs(numeric).max())


def test_a_ray_and_the_image_ray_of_a_pixel_are_one_direction():
    camera = wide((0.3, -1.0, 0.2), (0.0, 0.0, 0.4))
    seen = PIXELS[camera.sees(PIXELS)][::97]
    rays, images = camera.rays(seen), camera.image_rays(seen)
    assert np.allclose(rays / np.linalg.norm(rays, axis=1, keepdims=True), images, atol=1e-12)
    assert np.isfinite(camera.image_rays(PIXELS)).all()


@pytest.mark.parametrize("degrees", [3, 40, 70, 80])
def test_a_spheres_disc_tells_its_centre_its_size_and_its_depth(degrees):
    """Traced by its tangent cone; the disc's middle is that of its area."""
    camera, distance, radius = wide(), 1.2, 0.05
    theta = np.radians(degrees)
    axis = np.array([0.8 * np.sin(theta), 0.6 * np.sin(theta), np.cos(theta)])
    alpha, turn = np.arcsin(radius / distance), np.linspace(0, 2 * np.pi, 2000, endpoint=False)[:, None]
    side = np.cross(axis, [1.0, 0.0, 0.0])
    side /= np.linalg.norm(side)
    rim = np.cos(alpha) * axis + np.sin(alpha) * (np.cos(turn) * side + np.sin(turn) * np.cross(axis, side))
    disc, area = middle_and_area(LENS.project(rim))
    true, size = LENS.project(distance * axis[None])[0], float(np.sqrt(area / np.pi))
    assert np.linalg.norm(sphere_centre(camera, disc, size) - true) < 0.02 * np.linalg.norm(disc - true)
    assert LENS.size_px(distance * axis, radius) == pytest.approx(size, rel=2e-4)
    ray = np.append(LENS.undistort(true[None])[0], 1.0)[None]
    assert LENS.depth_m(ray, np.array([size]), radius)[0] == pytest.approx(distance * np.cos(theta), rel=2e-4)


def middle_and_area(outline):
    x, y = outline.T
    after_x, after_y = np.roll(x, -1), np.roll(y, -1)
    parts = x * after_y - after_x * y
    return np.array([(x + after_x) @ parts, (y + after_y) @ parts]) / (3 * parts.sum()), abs(parts.sum()) / 2


def test_two_wide_cameras_triangulate_with_the_covariance_that_they_tell():
    rng, cameras = np.random.default_rng(10624), [wide((x, -0.6, 0.1), (0, 0, 0)) for x in (-0.4, 0.4)]
    point, scores = np.array([0.5, -0.25, 0.3]), []
    for _ in range(200):
        rows = [
            sight_rows(camera, camera.project(point)[0] + 0.2 * rng.standard_normal(2), 0.04 * np.eye(2))
            for camera in cameras
        ]
        found = triangulate(rows)
        off = found.position_m - point
        scores.append(off @ np.linalg.solve(found.covariance_m2, off))
    assert np.mean(scores) == pytest.approx(3.0, abs=4 * np.sqrt(2 * 3 / 200))


def test_a_sight_beyond_the_edge_is_no_place():
    rows = [sight_rows(wide((x, -0.6, 0.1), (0, 0, 0)), np.zeros(2), np.eye(2)) for x in (-0.4, 0.4)]
    assert triangulate(rows) is None


def test_a_marker_far_off_the_axis_has_its_pose_and_covariance():
    rng, camera = np.random.default_rng(10625), wide()
    rotation = cv2.Rodrigues(np.array([np.pi - 0.5, 0.5, 0.1]))[0]
    place, scores = np.array([0.45, -0.25, 0.3]), []
    corners = LENS.project(0.06 * CORNERS @ rotation.T + place)
    best = marker_poses(corners, 0.06, camera)[0]
    assert np.allclose(best.place_m, place, atol=1e-7)
    assert np.allclose(best.rotation, rotation, atol=1e-5)
    for _ in range(60):
        found = marker_poses(corners + 0.1 * rng.standard_normal((4, 2)), 0.06, camera)
        near = min(found, key=lambda one: np.linalg.norm(one.rotation - rotation))
        off = near.place_m - place
        scores.append(off @ np.linalg.solve(0.01 * near.covariance[:3, :3], off))
    assert 1.5 < np.mean(scores) < 5.0  # 3 expected, the mean of 60 with 0.32 of deviation, and curvature
    assert marker_poses(np.zeros((4, 2)), 0.06, camera) == []


def test_a_fifth_number_is_refused():
    with pytest.raises(ValueError, match=r"camera 'wide': a fisheye lens has k1, k2, k3, k4; .* must be 0, not 0\.1"):
        wide(numbers=(0.0, 0.0, 0.0, 0.0, 0.1))


def film(camera, places_m, rng):
    """The track of a ball of 0.03 m of radius, with a false sighting in the image's dark corner."""
    n = len(places_m)
    centre = camera.project(places_m) + 0.1 * rng.standard_normal((n, 2))
    centre[n // 2] = (1.0, 1.0)
    size = np.array([camera.size_px(place, 0.03) for place in places_m])
    frame, covariance = np.arange(n, dtype=float), np.tile(0.01 * np.eye(2), (n, 1, 1))
    return FilmTrack(camera.name, frame, frame / 60, centre, covariance, size, np.ones(n), np.full((n, 2), np.nan))


def test_films_of_wide_cameras_give_metres_and_a_sighting_in_the_dark_counts_for_nothing():
    rng, t = np.random.default_rng(10626), np.linspace(0, 1, 40)
    places = np.column_stack([-0.6 + 1.2 * t, -0.1 + 0.2 * t, 0.4 + t - 1.5 * t**2])
    cameras = [wide((x, -0.7, 0.1), (0, 0, 0.2)) for x in (-0.4, 0.4)]
    tracks = [film(camera, places, rng) for camera in cameras]
    several = from_several(tracks, cameras, np.zeros(1))
    one = from_one(tracks[0], cameras[0], 0.03)
    assert len(one.t_s) == 39
    for found, most_m in ((several, 0.002), (one, 0.003)):
        off = found.position_m - places[np.rint(found.t_s * 60).astype(int)]
        assert np.isfinite(off).all()
        assert np.median(np.linalg.norm(off, axis=1)) < most_m
    across = np.einsum("ni,nij,nj->n", off, np.linalg.pinv(one.covariance_m2), off)
    assert np.median(across) < 3.0
