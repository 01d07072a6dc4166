"""The tracker on sightings: what is fed to the estimator, and where the next image is searched."""

import dataclasses

import numpy as np
import pytest

from kendama_cli.vision.ball_search import LOST_FRAMES
from kendama_cli.vision.catch_pose import CatchPoseEstimator
from kendama_cli.vision.interface import Sighting
from kendama_cli.vision.onset import FreeFlightOnset
from kendama_cli.vision.region import Region, whole
from kendama_cli.vision.release import draw_release
from kendama_cli.vision.tracker import BallTracker, sphere_centre
from tests.vision.scenes import game, predict, stereo

CAMERAS = stereo()
BLACK = np.zeros((40, 40, 3), dtype=np.uint8)


class Script:
    """A detector that finds ``answer``, whatever the image, and keeps the hints that it is given."""

    def __init__(self):
        self.answer = None
        self.hints = []

    def candidates(self, pixels, origin_px=(0, 0), hint=None):
        self.hints.append(hint)
        return iter(() if self.answer is None else (self.answer,))


def sighting(pixel, sigma_px=0.1):
    return Sighting(np.asarray(pixel, dtype=float), sigma_px**2 * np.eye(2), 8.0, 1.0)


def tracker(onset=True, detector=None):
    drag_per_s, drag_per_m = game().drag_per_mass
    estimator = CatchPoseEstimator(game().gravity_m_s2, drag_per_s, game().cup.rim_m, drag_per_m=drag_per_m)
    test = FreeFlightOnset(predict().onset, estimator.flight) if onset else None
    return BallTracker(CAMERAS, detector or Script(), estimator, test)


def shown(ball_m, rng, cameras=CAMERAS):
    """What every camera says of a ball at ``ball_m``."""
    seen = {}
    for camera in cameras:
        pixel = camera.project(ball_m)[0]
        disc = pixel + (pixel - sphere_centre(camera, pixel, 8.0)) + 0.1 * rng.standard_normal(2)
        seen[camera.name] = sighting(disc)
    return seen


def fly(made, release, rng, begin_s, end_s, spoil=None):  # noqa: PLR0917
    """Feed a release at 120 fps, each moment as ``spoil`` turns (t, sightings) into others; (time, pose) of each."""
    poses = []
    for t in np.arange(begin_s, end_s, 1 / 120):
        seen = shown(release.ball_m(t), rng)
        poses.append((t, made.update(t, seen if spoil is None else spoil(t, seen), release.tie_m(t))))
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
    detector = Script()
    made = tracker(onset=False, detector=detector)
    everything = whole(640, 480)
    assert made.search.region("left", 0.0) == everything
    detector.answer = sighting([200.0, 200.0])
    made.search.detect("left", 0.0, BLACK, (0, 0))
    detector.answer = sighting([205.0, 198.0])
    made.search.detect("left", 0.01, BLACK, (0, 0))
    near = made.search.region("left", 0.02)
    assert (near.left + near.right - 1) / 2 == pytest.approx(210.0)
    assert (near.top + near.bottom - 1) / 2 == pytest.approx(196.0)
    detector.answer = None
    sizes = [near.right - near.left]
    for frame in range(LOST_FRAMES):
        assert made.search.detect("left", 0.02 + 0.01 * frame, BLACK, (0, 0)) is None
        region = made.search.region("left", 0.03 + 0.01 * frame)
        sizes.append(region.right - region.left)
    assert sizes == sorted(sizes)
    assert made.search.region("left", 0.1) == everything


def test_the_search_follows_the_prediction_through_frames_in_which_nothing_is_seen():
    detector = Script()
    rng = np.random.default_rng(43)
    release, made = draw_release(rng, predict().release, game(), 0.2), tracker(onset=False, detector=detector)
    camera = CAMERAS[0]
    detector.answer = sighting(camera.project(release.ball_m(0.1))[0])
    made.search.detect("left", 0.1, BLACK, (0, 0))
    fly(made, release, rng, 0.0, 0.2)
    region = made.search.region("left", 0.24)
    u, v = camera.project(release.ball_m(0.24))[0]
    assert region.left < u < region.right
    assert region.top < v < region.bottom
    assert region.right - region.left < 80


def test_the_first_search_may_begin_at_an_expected_place():
    detector = Script()
    made = tracker(detector=detector)
    made.search.expect([0.1, 0.0, 0.3], 40.0)
    u, v = CAMERAS[1].project([0.1, 0.0, 0.3])[0]
    region = made.search.region("right", 0.0)
    assert region == Region(
        int(np.floor(u - 40)), int(np.floor(v - 40)), int(np.ceil(u + 40)) + 1, int(np.ceil(v + 40)) + 1
    )
    detector.answer = None
    made.search.detect("right", 0.0, BLACK, (0, 0))
    assert made.search.region("right", 0.01) == whole(640, 480)


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


def flight(seed):
    rng = np.random.default_rng(seed)
    return rng, draw_release(rng, predict().release, game(), 0.2)


def honest(pose, release):
    """Within five of its own standard deviations of the truth."""
    error = pose.position_m - release.crossing_m
    return np.linalg.norm(error) < 5 * np.sqrt(np.trace(pose.covariance_m2)) + 1e-3


def test_a_camera_that_stops_leaves_the_other_to_go_on():
    _, release = flight(44)
    both, one = tracker(), tracker()
    fly(both, release, np.random.default_rng(1), -0.1, 0.8 * release.crossing_s)
    half = 0.4 * release.crossing_s
    poses = fly(
        one, release, np.random.default_rng(1), -0.1, 0.8 * release.crossing_s,
        lambda t, seen: seen if t < half else {"left": seen["left"]},
    )  # fmt: skip
    last, full = poses[-1][1], both.estimator.catch()
    assert honest(last, release)
    assert np.trace(last.covariance_m2) > np.trace(full.covariance_m2)


def test_cameras_that_both_stop_leave_the_prediction_as_uncertain_as_it_was():
    rng, release = flight(45)
    made, half = tracker(), 0.4 * release.crossing_s
    poses = fly(
        made, release, rng, -0.1, 0.8 * release.crossing_s, lambda t, seen: seen if t < half else dict.fromkeys(seen)
    )
    frozen = [pose for t, pose in poses if t > half]
    assert honest(frozen[-1], release)
    assert np.trace(frozen[-1].covariance_m2) == np.trace(frozen[0].covariance_m2)


def test_an_image_that_comes_twice_is_taken_once():
    """Under its own stamp, and, as cameras that repeat their buffer do, under the next."""
    _, release = flight(46)
    once, twice = tracker(), tracker()
    rng = np.random.default_rng(2)
    for t in np.arange(-0.1, 0.7 * release.crossing_s, 1 / 120):
        seen = shown(release.ball_m(t), rng)
        once.update(t, seen, release.tie_m(t))
        twice.update(t, seen, release.tie_m(t))
        twice.update(t, seen, release.tie_m(t))
        twice.update(t + 1 / 240, seen, release.tie_m(t))
    assert twice.estimator.n_observations == once.estimator.n_observations
    assert np.array_equal(twice.estimator.catch().position_m, once.estimator.catch().position_m)


def test_images_that_arrive_late_but_with_their_own_stamps_are_used():
    rng, release = flight(47)
    made, held = tracker(), []

    def delayed(t, seen):
        held.append((t, seen["right"]))
        return {"left": seen["left"]} if t > 0.1 else seen

    fly(made, release, rng, -0.1, 0.7 * release.crossing_s, delayed)
    before = np.trace(made.estimator.catch().covariance_m2)
    for t, seen in held:
        if t > 0.1:
            made.update(t, {"right": seen}, release.tie_m(t))
    assert honest(made.estimator.catch(), release)
    assert np.trace(made.estimator.catch().covariance_m2) < before


def test_old_images_under_new_stamps_are_not_believed():
    """Three frames of delay that nobody tells: the ball seems to lag by some 10 px. The pose stays honest, or none."""
    for seed in range(48, 53):
        rng, release = flight(seed)
        made, past = tracker(), []

        def delayed(t, seen, past=past):
            past.append(seen)
            return past[-4] if t > 0.16 else seen

        poses = fly(made, release, rng, -0.1, 0.9 * release.crossing_s, delayed)
        assert all(pose is None or honest(pose, release) for t, pose in poses)


def test_a_ball_that_leaves_the_image_is_still_predicted():
    rng, release = flight(54)
    made = tracker()
    poses = fly(
        made, release, rng, -0.1, 0.8 * release.crossing_s,
        lambda t, seen: {name: one if t < 0.17 else None for name, one in seen.items()},
    )  # fmt: skip
    assert honest(poses[-1][1], release)
    assert not made.lost


def test_another_ball_in_the_picture_is_refused_by_the_prediction():
    _, release = flight(55)
    alone, beside = tracker(), tracker()
    end_s = 0.7 * release.crossing_s
    fly(alone, release, np.random.default_rng(3), -0.1, end_s, lambda t, seen: seen if t < 0.16 else {})
    noise = np.random.default_rng(4)

    def other(t, seen):
        return seen if t < 0.16 else shown([0.15, 0.1, 0.4], noise, CAMERAS[:1])

    poses = fly(beside, release, np.random.default_rng(3), -0.1, min(end_s, 0.16 + 4 / 120), other)
    assert np.array_equal(poses[-1][1].position_m, alone.estimator.catch().position_m)


def test_a_ball_that_does_something_else_altogether_is_told_as_lost_and_followed_anew():
    rng, release = flight(56)
    made = tracker(onset=False)
    fly(made, release, rng, 0.0, 0.5 * release.crossing_s)
    lost = []
    for frame in range(30):  # somebody took it out of the air and drops it elsewhere
        t = 0.5 * release.crossing_s + (frame + 1) / 120
        s = t - 0.5 * release.crossing_s
        ball = np.array([0.2, 0.1, 0.6 + 1.0 * s - 9.81 / 2 * s * s])
        pose = made.update(t, shown(ball, rng), release.tie_m(t))
        lost.append(made.lost)
    assert any(lost)
    assert not lost[-1]
    assert np.abs(pose.position_m[:2] - [0.2, 0.1]).max() < 0.02


def test_a_wrong_calibration_is_owned_to():
    """The right camera looks up by two tenths of a degree, two pixels: no pose is predicted as surer than it is."""
    pitch = np.deg2rad(0.2)
    turn = np.array([[1, 0, 0], [0, np.cos(pitch), -np.sin(pitch)], [0, np.sin(pitch), np.cos(pitch)]])
    believed = [CAMERAS[0], dataclasses.replace(CAMERAS[1], world_to_camera=turn @ CAMERAS[1].world_to_camera)]
    for seed in range(57, 62):
        _, release = flight(seed)
        made, right = tracker(), tracker()
        made.cameras = {camera.name: camera for camera in believed}
        last = fly(made, release, np.random.default_rng(seed), -0.1, 0.8 * release.crossing_s)[-1][1]
        best = fly(right, release, np.random.default_rng(seed), -0.1, 0.8 * release.crossing_s)[-1][1]
        assert last is None or honest(last, release)
        assert last is None or np.trace(last.covariance_m2) > 4 * np.trace(best.covariance_m2)


def test_the_search_hints_the_detector_where_the_ball_should_be():
    """So that of two balls in the region the right one is taken."""
    detector = Script()
    made = BallTracker(CAMERAS, detector, CatchPoseEstimator(9.81, 0.0, 0.07))
    for step in range(3):
        detector.answer = sighting([200.0 + 5 * step, 200.0])
        made.search.detect("left", 0.01 * step, BLACK, (0, 0))
    assert detector.hints[0] is None
    assert detector.hints[2].centre_px == pytest.approx([210.0, 200.0])


def test_a_rope_that_was_slack_for_a_moment_only_is_noticed():
    """A swing of 80 deg: at its turning points the rope hardly pulls; soon after, no flight fits what is seen."""
    rng, made, pivot = np.random.default_rng(63), tracker(), np.array([0.0, 0.0, 0.4])
    phi, rate, found, predicted = np.deg2rad(80.0), 0.0, [], []
    for frame in range(180):
        for _ in range(20):
            rate -= 9.81 / 0.4 * np.sin(phi) / 2400
            phi += rate / 2400
        ball = pivot + 0.4 * np.array([np.sin(phi), 0.0, -np.cos(phi)])
        pose = made.update(frame / 120, shown(ball, rng), pivot)
        found.append(made.found is not None)
        predicted.append(pose is not None)
    first = found.index(True)
    assert not all(found[first : first + 48])
    assert np.mean(predicted) < 0.5
