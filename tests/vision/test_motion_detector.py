"""The detector that goes by motion: a ball on a string before a still camera, nothing taught."""

import numpy as np
import pytest

from kendama_cli.errors import StageError
from kendama_cli.vision.ball_film import film_track
from kendama_cli.vision.interface import SearchHint
from kendama_cli.vision.motion_detector import MotionDetector
from kendama_cli.vision.settings import MotionDetectorSettings
from tests.vision.ball_films import RATE_HZ, draw_ball, pendulum, textured

FRAMES = 90
SETTINGS = MotionDetectorSettings("motion", 2.0, 120.0, 10.0, 2.2, 41, 6)


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


@pytest.mark.parametrize(
    "options",
    [
        {"string_px": 2},
        {"string_px": 3, "jpeg": 60},
        {"hand": True, "string_px": 2, "colour": (235, 235, 235)},
        {"hand": True, "shadow": 0.2, "drift": 0.06, "string_px": 2, "colour": (60, 110, 200), "jpeg": 80},
    ],
    ids=["a string", "a thick string in JPEG", "a hand", "a hand, shadows, an exposure that drifts"],
)
def test_the_ball_is_told_from_what_moves_with_it(options):
    frames, truth = pendulum(FRAMES, 10020, background=textured(10021), **options)
    recall, precision, rms = scored(frames, truth, 7.0)
    assert recall >= 0.97
    assert precision >= 0.99
    assert rms <= 1.0


def test_a_shadow_that_is_as_round_as_the_ball_is_not_the_ball():
    frames, truth = pendulum(
        FRAMES, 10022, background=np.full((240, 320, 3), 170, np.uint8), colour=(110, 150, 215), shadow=0.3
    )
    recall, precision, _ = scored(frames, truth, 7.0)
    assert recall >= 0.97
    assert precision >= 0.99


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


def painted(rng, cut, second):
    """An image of a dark ball, ``second`` beyond ``cut`` of its radius from its centre, and that centre.

    What lies in one pixel is mixed as light is, and encoded after it.
    """
    centre, turn = rng.uniform(40, 80, 2), rng.uniform(0, 2 * np.pi)
    v, u = np.indices((960, 1280)) / 8.0 - 0.4375  # 8 x 8 samples a pixel
    inside = np.hypot(u - centre[0], v - centre[1]) < 8.0
    beyond = (u - centre[0]) * np.cos(turn) + (v - centre[1]) * np.sin(turn) > cut * 8.0
    light = (np.where(inside, np.where(beyond, second, 20), 150) / 255) ** SETTINGS.gamma
    mixed = 255 * light.reshape(120, 8, 160, 8).mean(axis=(1, 3)) ** (1 / SETTINGS.gamma)
    noisy = mixed[:, :, None] + rng.normal(0, 2, (120, 160, 3))
    return np.clip(np.rint(noisy), 0, 255).astype(np.uint8), centre


@pytest.mark.parametrize(
    ("cut", "second", "is_sized", "most_px"),
    [(0.0, 20, False, 0.1), (0.0, 235, False, 0.6), (0.0, 235, True, 0.3), (0.6, 200, True, 0.3)],
    ids=["one colour", "two halves", "two halves of known size", "a bright cap of known size"],
)
def test_the_centre_is_the_whole_balls_also_where_its_parts_differ(cut, second, is_sized, most_px):
    """Before a grey wall the difference of a white half is half that of a black one; 20 places each, seed 10010."""
    rng = np.random.default_rng(10010)
    detector = MotionDetector(SETTINGS)
    detector.learn([np.full((120, 160, 3), 150, dtype=np.uint8)])
    for _ in range(20):
        pixels, centre = painted(rng, cut, second)
        hint = SearchHint(centre + rng.normal(0, 2, 2), 8.0 * (1 + 0.02 * rng.normal()), is_sized)
        found = next(detector.candidates(pixels, (0, 0), hint))
        assert np.hypot(*(found.centre_px - centre)) < most_px
        assert found.radius_px == pytest.approx(8.0, abs=0.8)


def test_a_size_that_is_not_the_balls_spoils_nothing():
    """Who measured another ball than he throws has it found as well as one of unknown size."""
    rng = np.random.default_rng(10011)
    detector = MotionDetector(SETTINGS)
    detector.learn([np.full((120, 160, 3), 150, dtype=np.uint8)])
    for factor in (0.5, 0.7, 1.3, 1.8):
        pixels, centre = painted(rng, 0.0, 20)
        found = next(detector.candidates(pixels, (0, 0), SearchHint(centre, 8.0 * factor, True)))
        assert np.hypot(*(found.centre_px - centre)) < 0.1
        assert found.radius_px == pytest.approx(8.0, abs=0.3)


def test_where_the_ball_was_when_the_background_was_taken_it_is_not_seen():
    rng = np.random.default_rng(10012)
    detector = MotionDetector(SETTINGS)
    before, there = painted(rng, 0.0, 20)
    detector.learn([before])
    pixels = np.full_like(before, 150)
    now = there + np.array([25.0, 10.0])
    draw_ball(pixels, now, 8.0, (20, 20, 20))
    first, *others = detector.candidates(pixels, (0, 0), SearchHint(there, 8.0, True))
    assert np.hypot(*(first.centre_px - now)) < 0.3
    assert not others
