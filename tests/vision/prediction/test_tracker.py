"""The tracker on sightings: what is fed to the estimator, and where the next image is searched."""

import numpy as np
import pytest

from kendama_cli.vision.cameras.region import Region, whole
from kendama_cli.vision.detection.ball_search import LOST_FRAMES
from kendama_cli.vision.prediction.catch_pose import CatchPoseEstimator
from kendama_cli.vision.prediction.release import draw_release
from kendama_cli.vision.prediction.tracker import BallTracker
from tests.vision.followed_flight import BLACK, CAMERAS, Script, fly, shown, sighting, tracker
from tests.vision.scenes import game, predict


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
    # 1.6 radii of 8 px and 10 px, and 10 px more for each image without the ball; whole pixels, within the image
    assert sizes[:3] == pytest.approx([2 * (12.8 + 10 * (1 + lost)) for lost in range(3)], abs=2)
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
    for step in range(LOST_FRAMES):
        detector.answer = None if step % 2 else sighting([u + 40 + 20 * step + 5, v])
        assert made.search.detect("right", 0.01 * step, BLACK, (0, 0)) is None, "what is farther away is another thing"
        wider = made.search.region("right", 0.01 * (step + 1))
        assert wider.right - wider.left > region.right - region.left
        region = wider
    assert region == whole(640, 480)
    assert detector.hints[0].radius_px == 0.0, "nothing is known of its size"


def test_the_search_hints_the_detector_where_the_ball_should_be():
    """So that of two balls in the region the right one is taken."""
    detector = Script()
    made = BallTracker(CAMERAS, lambda: detector, CatchPoseEstimator(9.81, 0.0, 0.07))
    for step in range(3):
        detector.answer = sighting([200.0 + 5 * step, 200.0])
        made.search.detect("left", 1.0 + 0.01 * step, BLACK, (0, 0))
    assert detector.hints[0] is None
    assert detector.hints[2].centre_px == pytest.approx([210.0, 200.0])


def test_a_rope_that_was_slack_for_an_instant_only_is_noticed():
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
