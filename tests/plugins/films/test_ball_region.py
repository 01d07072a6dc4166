"""The ball's region in a film: discs found by colours, where a detector looks at a part of the ball."""

import numpy as np
import pytest

from kendama_cli.plugins.films.ball_box import BallBox, TrainedImage
from kendama_cli.plugins.films.ball_film import film_track
from kendama_cli.plugins.films.ball_region import placed
from kendama_cli.plugins.films.settings import TrainedDetectorSettings
from kendama_cli.plugins.films.trained_detector import TrainedDetector
from kendama_cli.plugins.films.training import teach
from kendama_cli.vision.detection.interface import Sighting
from tests.vision.ball_films import draw_ball, labelled_image, pendulum, textured

FRAMES = 16


def taught(seeds):
    images = []
    for seed in seeds:
        image, (u, v, width, height) = labelled_image(seed)
        images.append(TrainedImage(image, (BallBox(u, v, width, height),)))
    return images


def seen(seed, *, radius_px=10.0, larger=1.25, colours=((60, 60, 65), (40, 120, 235)), background=None):
    """Frames of the ball before a background that no box has shown, its centres and its radii; and sightings of it,
    0.4 radii beside the middle with 0.8 of the radius, as a detector has them that looks at a part."""
    rng = np.random.default_rng(seed)
    frames, sightings, centres, radii = [], [], [], []
    for frame in range(FRAMES):
        image = textured(seed + frame // 4) if background is None else background.copy()
        centre = rng.uniform([50, 50], [270, 190])
        radius = radius_px * larger ** np.sin(frame)
        draw_ball(image, centre, radius, colours[0], stripe=colours[1], angle_deg=40.0 * frame)
        image = np.clip(image + rng.normal(0, 4, image.shape), 0, 255).astype(np.uint8)
        beside = centre + 0.4 * radius_px * np.array([0.6, -0.8]) + rng.normal(0, 0.1 * radius_px, 2)
        frames.append(image)
        sightings.append(Sighting(beside, np.eye(2), 0.8 * radius_px, 0.9))
        centres.append(centre)
        radii.append(radius)
    return frames, sightings, np.array(centres), np.array(radii)


def disc(frames, sightings):
    """Sightings at the ball's disc, of frames in a row."""
    found = placed(dict(enumerate(sightings)), frames, taught(range(10000, 10005)))
    assert list(found) == list(range(len(sightings)))
    return list(found.values())


def test_sightings_beside_the_middle_and_too_small_come_to_the_balls_disc():
    frames, sightings, centres, radii = seen(10120)
    found = disc(frames, sightings)
    off = np.array([one.centre_px for one in found]) - centres
    before = np.array([one.centre_px for one in sightings]) - centres
    assert np.sqrt(np.mean(np.sum(before**2, axis=1))) > 4.0
    assert np.sqrt(np.mean(np.sum(off**2, axis=1))) < 0.6
    drawn = radii + 0.53  # what OpenCV's disc covers
    larger = np.abs(np.array([one.radius_px for one in found]) / drawn - 1)
    assert np.median(larger) < 0.015
    assert larger.max() < 0.06


def test_score_stays_on_the_ball_and_falls_where_its_colours_are_missing():
    frames, sightings, *_ = seen(10120)
    for number in (3, 11):
        u, v = sightings[number].centre_px
        beside = np.array([u + (60 if u < 160 else -60), v])
        sightings[number] = Sighting(beside, np.eye(2), 8.0, 0.9)
    scores = np.array([one.score for one in disc(frames, sightings)])
    assert scores[[3, 11]].max() < 0.5
    assert np.delete(scores, [3, 11]).min() == 0.9


def test_a_ball_with_the_colours_about_it_stays_where_it_is_seen():
    background = np.full((240, 320, 3), (60, 60, 65), dtype=np.uint8)
    frames, sightings, *_ = seen(10100, colours=((60, 60, 65), (62, 62, 67)), background=background)
    assert disc(frames, sightings) == sightings


@pytest.mark.slow
def test_on_a_background_that_no_box_has_shown_a_swing_is_placed_to_a_tenth_of_the_radius():
    """Dark discs of the ball's size hang about, and the light is another: 29 of 40 on this seed."""
    images, background = taught(range(10000, 10005)), textured(10077)
    for place in ((60, 60), (250, 120), (120, 200), (200, 40)):
        draw_ball(background, place, 10.0, (70, 75, 80), stripe=(60, 90, 120), angle_deg=20.0)
    frames, truth = pendulum(
        40, 10000, background=background, radius_px=10.0, colour=(60, 60, 65), stripe=(40, 120, 235)
    )
    detector = TrainedDetector(TrainedDetectorSettings("trained", "", 20, 0.5, 1), teach(images))

    def off_px(images):
        found = film_track("swing", lambda: ((0.0, frame) for frame in frames), detector, 0.5, images)
        return np.hypot(*(found.centre_px - truth[found.frame.astype(int)]).T)

    assert (off_px(()) < 1.0).sum() < (off_px(images) < 1.0).sum()
    assert (off_px(images) < 1.0).sum() >= 27
