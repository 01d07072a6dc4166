"""Noise of a film's codec does not vote on the ball's size, and a track that is no ball's is known as such."""

import cv2
import numpy as np
import pytest

from kendama_cli.vision.ball_film import FilmTrack
from kendama_cli.vision.image_change import change_of
from kendama_cli.vision.usual_size import usual_radius_px

SMALLEST_PX = 2.0


def test_specks_in_every_image_do_not_outvote_the_ball_in_a_few() -> None:
    rng, changes = np.random.default_rng(10000), []
    for number in range(11):
        background = np.full((360, 640, 3), 120, np.uint8)
        image = background.copy()
        for place in rng.integers(20, 340, (3, 2)):  # barely above contrast_min, as a codec's are
            cv2.circle(image, tuple(map(int, place)), 4, (134, 134, 134), -1)
        if number in (4, 5):
            cv2.circle(image, (200 + 90 * number, 180), 14, (60, 160, 200), -1, cv2.LINE_AA)
        changes.append(change_of(image, background, 10.0))
    assert usual_radius_px(changes, SMALLEST_PX, 120.0) == pytest.approx(14.0, rel=0.1)


def track(frames, centres_px, radius_px) -> FilmTrack:
    n = len(frames)
    return FilmTrack(
        "film", np.asarray(frames, float), np.asarray(frames) / 30.0, np.asarray(centres_px, float),
        np.tile(np.eye(2), (n, 1, 1)), np.full(n, radius_px), np.ones(n), np.full((n, 2), np.nan),
    )  # fmt: skip


def thrown(frames):
    """A ball that flies and bounces at frame 20, with a pixel of noise."""
    t = np.asarray(frames, float)
    down = np.where(t < 20, 500 - 30 * t + 1.4 * t**2, 460 - 34 * (t - 20) + 1.4 * (t - 20) ** 2)
    return np.column_stack([200 + 18 * t, down]) + np.random.default_rng(10001).normal(0, 1, (len(t), 2))


def test_a_thrown_ball_is_one_though_it_bounces_and_is_missed_at_times() -> None:
    every = np.arange(40)
    for frames in (every, np.delete(every, [3, 11, 12, 26])):
        seen = track(frames, thrown(frames), 12.0).evidence()
        assert seen.is_ball(SMALLEST_PX)
        assert seen.longest >= 10
        assert seen.smooth_share > 0.6


@pytest.mark.parametrize("name", ["hops", "flickers at one place", "has the smallest radius", "is seen thrice"])
def test_a_track_that_is_no_balls_is_told(name: str) -> None:
    rng, frames = np.random.default_rng(10002), np.arange(60)
    places, radius_px = {
        "hops": (rng.uniform(0, [1280, 720], (60, 2)), 20.0),
        "flickers at one place": (rng.normal([400, 300], 0.5, (60, 2)), 20.0),
        "has the smallest radius": (thrown(frames), 2.3),
        "is seen thrice": (thrown(frames), 20.0),
    }[name]
    seen = (frames[:3] if "thrice" in name else frames), places
    found = track(seen[0], seen[1][: len(seen[0])], radius_px).evidence()
    assert not found.is_ball(SMALLEST_PX)
    assert found.smooth_share < 0.1 or name != "hops"


def test_of_random_tracks_hardly_one_in_a_thousand_passes() -> None:
    """The null: places drawn evenly over the image, of 45 of 60 frames, as noise was tracked on a film."""
    rng = np.random.default_rng(10003)
    passed = 0
    for _ in range(300):
        frames = np.sort(rng.choice(60, 45, replace=False))
        passed += track(frames, rng.uniform(0, [1280, 720], (45, 2)), 20.0).evidence().is_ball(SMALLEST_PX)
    assert passed == 0
