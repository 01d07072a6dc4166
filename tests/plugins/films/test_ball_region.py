"""The ball's region in a film: discs found by colours, where a detector looks at a part of the ball."""

import numpy as np
import pytest

from kendama_cli.plugins.films.ball_box import BallBox, TrainedImage
from kendama_cli.plugins.films.ball_region import BallRegion, learn_region
from kendama_cli.plugins.films.self_training import RegionDetector
from kendama_cli.vision.detection.interface import Sighting
from tests.vision.ball_films import draw_ball, labelled_image, textured

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


def learned(seed, **how):
    frames, sightings, centres, radii = seen(seed, **how)
    region = learn_region(taught(range(10000, 10005)), list(zip(frames, sightings, strict=True)))
    return region, frames, sightings, centres, radii


@pytest.fixture(scope="module")
def region() -> BallRegion:
    found, *_ = learned(10100)
    return found


def test_sightings_beside_the_middle_and_too_small_come_to_the_balls_disc(region):
    frames, sightings, centres, radii = seen(10120)
    placed = [region.placed(frame, one) for frame, one in zip(frames, sightings, strict=True)]
    off = np.array([one.centre_px for one in placed]) - centres
    before = np.array([one.centre_px for one in sightings]) - centres
    assert np.sqrt(np.mean(np.sum(before**2, axis=1))) > 4.0
    assert np.sqrt(np.mean(np.sum(off**2, axis=1))) < 0.6
    drawn = radii + 0.53  # what OpenCV's disc covers
    assert np.abs(np.array([one.radius_px for one in placed]) / drawn - 1).max() < 0.04


def test_score_stays_on_the_ball_and_falls_where_its_colours_are_missing(region):
    frames, sightings, *_ = seen(10120)
    away = [one.centre_px + np.array([60 if one.centre_px[0] < 160 else -60, 0]) for one in sightings]
    kept = [region.placed(frame, one).score for frame, one in zip(frames, sightings, strict=True)]
    lost = [region.placed(f, Sighting(place, np.eye(2), 8.0, 0.9)).score for f, place in zip(frames, away, strict=True)]
    assert min(kept) == 0.9
    assert max(lost) < 0.5


def test_a_ball_with_the_colours_about_it_has_no_region():
    background = np.full((240, 320, 3), (60, 60, 65), dtype=np.uint8)
    found, *_ = learned(10100, colours=((60, 60, 65), (62, 62, 67)), background=background)
    assert found is None


def test_a_detector_of_a_part_of_the_image_places_in_the_images_own_coordinates(region):
    frames, sightings, *_ = seen(10120)

    class Told:
        def candidates(self, pixels, origin_px=(0, 0), hint=None):
            yield sightings[0]

    (whole,) = RegionDetector(Told(), region).candidates(frames[0])
    left, top = np.maximum(sightings[0].centre_px.astype(int) - 45, 0)
    (part,) = RegionDetector(Told(), region).candidates(frames[0][top:, left:], (left, top))
    assert np.abs(part.centre_px - whole.centre_px).max() < 0.1
    assert abs(part.radius_px - whole.radius_px) < 0.1
