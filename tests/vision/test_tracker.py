"""The tracker on sightings: what is fed to the estimator, and where the next image is searched."""

import numpy as np
import pytest

from kendama_cli.vision.catch_pose import CatchPoseEstimator
from kendama_cli.vision.detector import BallDetector, Sighting
from kendama_cli.vision.onset import FreeFlightOnset
from kendama_cli.vision.region import Region, whole
from kendama_cli.vision.release import draw_release
from kendama_cli.vision.tracker import LOST_FRAMES, BallTracker, sphere_centre
from tests.vision.scenes import game, predict, stereo

CAMERAS = stereo()
BLACK = np.zeros((40, 40, 3), dtype=np.uint8)


class Script(BallDetector):
    """A detector that says what it is told to."""

    def __init__(self):
        self.answer = None

    def find(self, pixels, origin_px=(0, 0)):
        return self.answer


def sighting(pixel, sigma_px=0.1):
    return Sighting(np.asarray(pixel, dtype=float), sigma_px**2 * np.eye(2), 8.0, 1.0)


def tracker(onset=True):
    rim, drag = game().cup.depth_m, game().ball.drag_n_s_m / game().ball.mass_kg
    estimator = CatchPoseEstimator(game().gravity_m_s2, drag, rim)
    test = FreeFlightOnset(predict().onset, estimator.flight) if onset else None
    return BallTracker(CAMERAS, Script(), estimator, test)


def fly(made, release, rng, begin_s, end_s):
    """Feed a release at 120 fps; (time, pose) after every moment."""
    poses = []
    for t in np.arange(begin_s, end_s, 1 / 120):
        seen = {}
        for camera in CAMERAS:
            pixel = camera.project(release.ball_m(t))[0]
            disc = pixel + (pixel - sphere_centre(camera, pixel, 8.0)) + 0.1 * rng.standard_normal(2)
            seen[camera.name] = sighting(disc)
        poses.append((t, made.update(t, seen, release.tie_m(t))))
    return poses


def test_no_pose_while_the_rope_is_taut_and_a_good_one_before_the_crossing():
    rng = np.random.default_rng(41)
    for _ in range(10):
        release, made = draw_release(rng, predict().release, game(), 0.2), tracker()
        poses = fly(made, release, rng, -0.15, 0.7 * release.crossing_s)
        assert all(pose is None for t, pose in poses if t < 0)
        last = poses[-1][1]
        assert np.linalg.norm(last.position_m - release.crossing_m) < 6e-3
        assert abs(last.t_s - release.crossing_s) < 2e-3
        assert made.found.since_s > -0.01


def test_without_the_onset_test_taut_frames_would_spoil_the_prediction():
    rng = np.random.default_rng(42)
    release, made = draw_release(rng, predict().release, game(), 0.2), tracker(onset=False)
    spoilt = fly(made, release, rng, -0.1, 0.5 * release.crossing_s)[-1][1]
    assert spoilt is None or np.linalg.norm(spoilt.position_m - release.crossing_m) > 0.02


def test_the_search_follows_the_ball_and_widens_while_it_is_lost():
    made = tracker(onset=False)
    everything = whole(640, 480)
    assert made.region("left", 0.0) == everything
    made._detector.answer = sighting([200.0, 200.0])
    made.look("left", 0.0, BLACK, (0, 0))
    made._detector.answer = sighting([205.0, 198.0])
    made.look("left", 0.01, BLACK, (0, 0))
    near = made.region("left", 0.02)
    assert (near.left + near.right - 1) / 2 == pytest.approx(210.0)
    assert (near.top + near.bottom - 1) / 2 == pytest.approx(196.0)
    made._detector.answer = None
    sizes = [near.right - near.left]
    for frame in range(LOST_FRAMES):
        assert made.look("left", 0.02 + 0.01 * frame, BLACK, (0, 0)) is None
        region = made.region("left", 0.03 + 0.01 * frame)
        sizes.append(region.right - region.left)
    assert sizes == sorted(sizes)
    assert made.region("left", 0.1) == everything


def test_the_search_follows_the_prediction_through_frames_in_which_nothing_is_seen():
    rng = np.random.default_rng(43)
    release, made = draw_release(rng, predict().release, game(), 0.2), tracker(onset=False)
    camera = CAMERAS[0]
    made._detector.answer = sighting(camera.project(release.ball_m(0.1))[0])
    made.look("left", 0.1, BLACK, (0, 0))
    fly(made, release, rng, 0.0, 0.2)
    region = made.region("left", 0.24)
    u, v = camera.project(release.ball_m(0.24))[0]
    assert region.left < u < region.right
    assert region.top < v < region.bottom
    assert region.right - region.left < 80


def test_the_first_search_may_begin_at_an_expected_place():
    made = tracker()
    made.expect([0.1, 0.0, 0.3], 40.0)
    u, v = CAMERAS[1].project([0.1, 0.0, 0.3])[0]
    region = made.region("right", 0.0)
    assert region == Region(
        int(np.floor(u - 40)), int(np.floor(v - 40)), int(np.ceil(u + 40)) + 1, int(np.ceil(v + 40)) + 1
    )
    made._detector.answer = None
    made.look("right", 0.0, BLACK, (0, 0))
    assert made.region("right", 0.01) == whole(640, 480)


def test_sphere_centre_is_where_the_middle_of_the_sphere_projects():
    """The disc of a large sphere off the axis, traced by its tangent cone, is corrected to within a tenth."""
    camera, radius = stereo(distortion=(0, 0, 0, 0, 0))[0], 0.08
    centre = camera.position_in_world_m + np.array([0.35, 0.25, 1.2]) @ camera.world_to_camera
    distance = np.linalg.norm(centre - camera.position_in_world_m)
    axis = (centre - camera.position_in_world_m) / distance
    side = np.cross(axis, [0, 0, 1.0])
    side /= np.linalg.norm(side)
    alpha = np.arcsin(radius / distance)
    turn = np.linspace(0, 2 * np.pi, 400, endpoint=False)[:, None]
    rim = np.cos(alpha) * axis + np.sin(alpha) * (np.cos(turn) * side + np.sin(turn) * np.cross(axis, side))
    outline = camera.project(camera.position_in_world_m + rim)
    disc = (outline.min(axis=0) + outline.max(axis=0)) / 2
    size = float(np.sqrt(np.prod((outline.max(axis=0) - outline.min(axis=0)) / 2)))
    true = camera.project(centre)[0]
    off = np.linalg.norm(disc - true)
    assert off > 0.5
    assert np.linalg.norm(sphere_centre(camera, disc, size) - true) < 0.15 * off
