"""The detector that goes by motion: a ball on a string before a still camera, nothing taught."""

import numpy as np
import pytest

from kendama_cli.errors import StageError
from kendama_cli.vision.ball_film import film_track
from kendama_cli.vision.interface import SearchHint
from kendama_cli.vision.motion_detector import MotionDetector
from kendama_cli.vision.settings import MotionDetectorSettings
from tests.vision.ball_films import RATE_HZ, pendulum, textured

FRAMES = 90
SETTINGS = MotionDetectorSettings("motion", 2.0, 120.0, 10.0, 41, 6)


def scored(frames, truth, radius_px):
    """Recall, precision and rms [px] of the track through ``frames``."""
    detector = MotionDetector(SETTINGS)
    detector.learn(frames)
    found = film_track("film", [(k / RATE_HZ, frame) for k, frame in enumerate(frames)], detector, 0.5)
    off = np.hypot(*(found.centre_px - truth[found.frame.astype(int)]).T)
    hit = off < radius_px
    return hit.sum() / len(truth), hit.mean(), np.sqrt((off[hit] ** 2).mean())


@pytest.mark.parametrize(
    ("name", "options"),
    [
        ("a dark ball", {}),
        ("a white ball", {"colour": (235, 235, 235)}),
        ("a ball of the background's hue with a light stripe", {"colour": (70, 80, 120), "stripe": (225, 225, 225)}),
        ("a ball of 3 px", {"colour": (235, 235, 235), "radius_px": 3.0}),
    ],
)
def test_every_frame_shows_the_swinging_ball_whatever_its_colour(name, options):
    frames, truth = pendulum(FRAMES, 10001, background=textured(10002), **options)
    recall, precision, rms = scored(frames, truth, options.get("radius_px", 7.0))
    assert recall >= 0.97, name
    assert precision >= 0.99, name
    assert rms <= 1.0, name


def test_a_ball_that_hung_still_while_the_background_was_taken_leaves_no_ghost():
    frames, truth = pendulum(FRAMES, 10003, background=np.full((240, 320, 3), 200, dtype=np.uint8), at_rest=35)
    recall, precision, _ = scored(frames, truth, 7.0)
    assert precision >= 0.99
    assert recall >= (FRAMES - 35) / FRAMES - 0.03  # where it hangs it is the background


def test_without_a_background_the_detector_says_what_to_do():
    with pytest.raises(StageError, match=r"has seen no background.*camera track"):
        next(MotionDetector(SETTINGS).candidates(textured(10008)))


def test_nothing_is_found_where_nothing_moves():
    rng = np.random.default_rng(10004)
    still = textured(10005)
    frames = [np.clip(still + rng.normal(0, 3, still.shape), 0, 255).astype(np.uint8) for _ in range(30)]
    detector = MotionDetector(SETTINGS)
    detector.learn(frames)
    assert not [one for frame in frames for one in detector.candidates(frame)]


def test_a_part_of_the_image_gives_the_whole_images_coordinates():
    frames, truth = pendulum(FRAMES, 10006, background=textured(10007))
    detector = MotionDetector(SETTINGS)
    detector.learn(frames)
    (u, v), frame = truth[10], frames[10]
    left, top = int(u) - 40, int(v) - 40
    part = np.ascontiguousarray(frame[max(top, 0) : top + 80, max(left, 0) : left + 80])
    found = next(detector.candidates(part, (max(left, 0), max(top, 0))))
    assert np.hypot(*(found.centre_px - truth[10])) < 1.5


@pytest.mark.parametrize(
    ("other", "most_px"), [((20, 20, 20), 0.15), ((235, 235, 235), 0.6)], ids=["one colour", "two halves"]
)
def test_the_centre_is_the_whole_balls_also_where_its_halves_differ(other, most_px):
    """Before a grey wall the difference of a white half is half that of a black one; 20 places each, seed 10010."""
    rng = np.random.default_rng(10010)
    wall, radius_px = np.full((120, 160, 3), 150, dtype=np.uint8), 8.0
    detector = MotionDetector(SETTINGS)
    detector.learn([wall])
    for _ in range(20):
        centre, turn = rng.uniform(40, 80, 2), rng.uniform(0, 2 * np.pi)
        v, u = np.indices((960, 1280)) / 8.0 - 0.4375  # 8 x 8 samples a pixel
        inside = np.hypot(u - centre[0], v - centre[1]) < radius_px
        half = (u - centre[0]) * np.cos(turn) + (v - centre[1]) * np.sin(turn) > 0
        fine = np.full((960, 1280, 3), 150.0)
        fine[inside & half], fine[inside & ~half] = (20, 20, 20), other
        pixels = fine.reshape(120, 8, 160, 8, 3).mean(axis=(1, 3)) + rng.normal(0, 2, wall.shape)
        hint = SearchHint(centre + rng.normal(0, 2, 2), radius_px)
        found = next(detector.candidates(np.clip(pixels, 0, 255).astype(np.uint8), (0, 0), hint))
        assert np.hypot(*(found.centre_px - centre)) < most_px
        assert found.radius_px == pytest.approx(radius_px, abs=0.8)
