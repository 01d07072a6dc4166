"""A ball that blurs into a streak gives both ends of the exposure; against images that are sampled independently."""

import numpy as np
import pytest

from kendama_cli.vision.ball_film import film_track
from kendama_cli.vision.motion_detector import MotionDetector
from kendama_cli.vision.settings import MotionDetectorSettings
from kendama_cli.vision.streak import StreakGuess, streak
from kendama_cli.vision.streak_cover import MovingDisc, moments
from tests.vision.ball_films import textured
from tests.vision.streaks import GAMMA, encoded, exposed, light

SETTINGS = MotionDetectorSettings("motion", 2.0, 120.0, 10.0, GAMMA, 41, 6)
RADIUS_PX = 9.0


def fitted(seed, length_px, look):
    """Error of the worse end [px], of the length as a part, and the squared error over its covariance."""
    rng = np.random.default_rng(seed)
    wall = textured(seed, 200, 160)
    centre, angle = rng.uniform([70, 60], [130, 100]), rng.uniform(0, 2 * np.pi)
    way = length_px * np.array([np.cos(angle), np.sin(angle)])
    pixels, before = exposed(wall, (centre, way), RADIUS_PX, look, rng), encoded(light(wall), rng, noise=1.0)
    guess = StreakGuess(centre + rng.normal(0, 2, 2), rng.uniform(0.7, 1.3) * way + rng.normal(0, 2, 2), 8.0)
    found = streak(pixels, before, GAMMA, guess)
    sign = np.sign(found.streak.way_px @ way)
    error = np.concatenate([found.centre_px - centre, sign * found.streak.way_px - way])
    turn = np.diag([1.0, 1.0, sign, sign])
    normal = error @ np.linalg.solve(turn @ found.streak.covariance_px2 @ turn, error)
    ends = [np.hypot(*(error[:2] + half * error[2:])) for half in (-0.5, 0.5)]
    return max(ends), abs(np.hypot(*found.streak.way_px) / length_px - 1), normal


@pytest.mark.parametrize(
    ("look", "length_px", "most_px", "most_part"),
    [
        ("dark", 10.0, 0.45, 0.04),
        ("white", 24.0, 0.2, 0.01),
        ("orange", 60.0, 0.6, 0.01),
        ("shaded", 24.0, 0.6, 0.015),
        ("two_tone", 40.0, 1.2, 0.025),
    ],
)
def test_both_ends_of_the_exposure_are_found(look, length_px, most_px, most_part):
    """The worst of four; the bounds are a little above the worst of 30, seeds 10640 to 10669."""
    ends, parts, normal = np.array([fitted(10700 + k, length_px, look) for k in range(4)]).T
    assert ends.max() < most_px
    assert parts.max() < most_part
    assert np.median(normal) < 9.5  # 95 % of a chi-square with four degrees of freedom


def test_the_slopes_of_the_cover_are_its_differences():
    rng = np.random.default_rng(10710)
    x, y = rng.uniform(-25, 25, 400), rng.uniform(-8, 8, 400)
    _, slopes = moments(x, y, MovingDisc(24.0, 9.0, 1.5), 3)
    at = np.array([24.0, 9.0, 1.5])
    for number, step in enumerate(np.vstack([np.zeros((2, 3)), np.eye(3)]) * 1e-3):
        right, down = (1e-3 * (number == k) for k in (0, 1))
        ahead, _ = moments(x + right, y + down, MovingDisc(*(at + step)), 3)
        behind, _ = moments(x - right, y - down, MovingDisc(*(at - step)), 3)
        # near the rim the chord's slope has no bound, and Simpson's rule is coarse
        assert np.median(np.abs((ahead - behind) / 2e-3 - slopes[number])) < 2e-3


def test_the_cover_is_the_part_of_the_exposure_in_which_a_disc_lies_over_the_pixel():
    rng = np.random.default_rng(10711)
    x, y = rng.uniform(-25, 25, 300), rng.uniform(-12, 12, 300)
    times = (np.arange(4000) + 0.5) / 4000 - 0.5
    sampled = np.array([(np.hypot(u - 24.0 * times, v) < 9.0).mean() for u, v in zip(x, y, strict=True)])
    values, _ = moments(x, y, MovingDisc(24.0, 9.0, 0.05), 0)
    assert np.abs(values[0] - sampled).max() < 0.01


@pytest.fixture(scope="module")
def flight():
    """Frames of a ball thrown across the image, the shutter open for half of the time, and where it was."""
    rng, wall = np.random.default_rng(10712), textured(10713)
    t_s = np.arange(-2, 10) / 30
    place = np.stack([30 + 1500 * t_s, 200 - 1300 * t_s + 2250 * t_s**2], axis=1)
    way = np.stack([np.full(len(t_s), 1500.0), -1300 + 4500 * t_s], axis=1) / 60
    seen = ((place > 45) & (place < [275, 195])).all(axis=1)
    frames = [
        exposed(wall, (one, move), RADIUS_PX, "orange", rng) if is_seen else encoded(light(wall), rng)
        for one, move, is_seen in zip(place, way, seen, strict=True)
    ]
    still = [encoded(light(wall), rng) for _ in range(8)]
    return frames + still, place, way, np.flatnonzero(seen)


def test_a_film_of_streaks_is_tracked_with_the_way_in_each_exposure(flight):
    frames, place, way, seen = flight
    detector = MotionDetector(SETTINGS)
    detector.learn(frames)
    found = film_track("film", [(k / 30, frame) for k, frame in enumerate(frames)], detector, 0.5)
    assert found.frame.astype(int).tolist() == seen.tolist()
    assert np.hypot(*(found.centre_px - place[seen]).T).max() < 0.5
    assert np.hypot(*(found.streak_px - way[seen]).T).max() < 0.02 * np.hypot(*way[seen].T).max()
