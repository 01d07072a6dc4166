"""A ball taught by boxes in a few images is found in others, and boxes that show something else are refused."""

import dataclasses

import cv2
import numpy as np
import pytest

from kendama_cli.plugins.films import training as teaching
from kendama_cli.plugins.films.ball_box import LEAST_CONTRAST, BallBox, TrainedImage
from kendama_cli.plugins.films.ball_patches import all_patches
from kendama_cli.plugins.films.settings import TrainedDetectorSettings
from kendama_cli.plugins.films.trained_detector import TrainedDetector
from kendama_cli.plugins.films.training import TrainedBall, refuse_unlike, teach
from kendama_cli.vision.detection.interface import SearchHint
from tests.vision.ball_films import draw_ball, labelled_image, textured

SETTINGS = TrainedDetectorSettings("trained", "", 1, 0.5, 6)


def shown(seed, *, ball=True):
    image, box = labelled_image(seed, ball=ball)
    return TrainedImage(image, () if box is None else (BallBox(*box),))


@pytest.fixture(scope="module", params=["quick", pytest.param("whole", marks=pytest.mark.slow)])
def ball(request):
    with pytest.MonkeyPatch.context() as patch:
        if request.param == "quick":
            patch.setattr(teaching, "CLASSIFIERS", 1)
            patch.setattr(teaching, "STEPS", 700)
        return teach([shown(seed) for seed in range(10000, 10004)])


def test_a_ball_taught_in_four_images_is_found_in_others(ball):
    detector = TrainedDetector(SETTINGS, ball)
    hits, sightings, tried = 0, 0, range(10100, 10120)
    for seed in tried:
        image, box = labelled_image(seed)
        found = [one for one in detector.candidates(image) if one.score >= SETTINGS.score_min][:1]
        sightings += len(found)
        hits += sum(float(np.hypot(*(one.centre_px - box[:2]))) < box[2] / 2 for one in found)
    assert hits >= 0.9 * len(tried)
    assert hits >= 0.9 * sightings


def test_no_ball_is_seen_where_there_is_none(ball):
    detector = TrainedDetector(SETTINGS, ball)
    wrong = sum(
        any(one.score >= SETTINGS.score_min for one in detector.candidates(labelled_image(seed, ball=False)[0]))
        for seed in range(10200, 10210)
    )
    assert wrong <= 1


def test_no_more_balls_are_believed_in_than_an_image_shows(ball):
    image = labelled_image(10210, ball=False)[0]
    places = np.array([(60.0, 60.0), (160.0, 180.0), (260.0, 90.0)])
    for place in places:
        draw_ball(image, place, 10.0, (60, 60, 65), stripe=(40, 120, 235))
    one, three = (
        list(TrainedDetector(dataclasses.replace(SETTINGS, balls=balls), ball).candidates(image)) for balls in (1, 3)
    )
    assert sum(sighting.score for sighting in one) <= 1
    assert min(sighting.score for sighting in three[:3]) > max(sighting.score for sighting in one)
    sure = np.array([sighting.centre_px for sighting in three if sighting.score >= SETTINGS.score_min])
    assert sorted(np.hypot(*(sure[:, None] - places).T).argmin(axis=0).tolist()) == [0, 1, 2]


def test_near_a_hint_the_ball_is_found_in_a_part_of_the_image(ball):
    image, box = labelled_image(10300)
    detector = TrainedDetector(SETTINGS, ball)
    hint = SearchHint(np.array(box[:2]) + 4.0, box[2] / 2)
    found = next(detector.candidates(image, hint=hint))
    assert np.hypot(*(found.centre_px - box[:2])) < box[2] / 2
    cut = np.ascontiguousarray(image[10:, 10:])
    assert np.allclose(next(detector.candidates(cut, (10, 10), hint)).centre_px, found.centre_px, atol=1.5)


def test_near_a_hint_the_place_is_that_of_the_whole_image(ball):
    """The part is scaled to whole pixels, which moved a ball of 10 px by up to half a pixel where that was not told."""
    off, detector = [], TrainedDetector(SETTINGS, ball)
    for seed in range(10310, 10330):
        image, box = labelled_image(seed)
        whole = next(detector.candidates(image))
        near = next(detector.candidates(image, hint=SearchHint(whole.centre_px, box[2] / 2)))
        off.append(near.centre_px - whole.centre_px)
    assert np.abs(np.median(off, axis=0)).max() < 0.1


def test_a_taught_ball_comes_back_from_its_file_to_the_last_bit(ball):
    again = TrainedBall.from_bytes(ball.to_bytes())
    image = labelled_image(10301)[0]
    first, second = (
        [np.array([*one.centre_px, one.score]) for one in TrainedDetector(SETTINGS, one).candidates(image)]
        for one in (ball, again)
    )
    assert np.array_equal(first, second)


@pytest.mark.parametrize("content", [b"", b"PK\x03\x04", b"no archive"])
def test_a_file_that_holds_no_taught_ball_is_refused(content):
    with pytest.raises(ValueError, match="no trained ball"):
        TrainedBall.from_bytes(content)


@pytest.mark.parametrize("seed", [11000, 11001, 11002])
def test_boxes_anywhere_on_a_textured_background_are_refused(seed):
    rng = np.random.default_rng(seed)
    images = []
    while len(images) < 3:
        pixels = textured(rng.integers(1 << 30))
        box = BallBox(*rng.uniform([30, 30], [290, 210]), 20.0, 20.0)
        if box.contrast(pixels) > 2 * LEAST_CONTRAST:
            images.append(TrainedImage(pixels, (box,)))
    with pytest.raises(ValueError, match=r"3 boxes do not show one ball|shows something else than the other"):
        teach(images)


def test_boxes_about_one_ball_are_not_refused():
    images, rng = [shown(seed) for seed in range(11010, 11013)], np.random.default_rng(0)
    refuse_unlike(images, all_patches(images, rng), rng)


def test_a_box_on_the_bare_wall_is_refused_and_named():
    images = [shown(seed) for seed in range(10000, 10004)]
    wall = TrainedImage(labelled_image(10004, ball=False)[0], (BallBox(160.0, 120.0, 20.0, 20.0),))
    with pytest.raises(ValueError, match="box at 160,120 in image 5 shows something else"):
        teach([*images, wall])


@pytest.mark.parametrize(
    ("images", "message"),
    [
        ([], "none of 0 images has a box"),
        ([TrainedImage(np.zeros((40, 40, 3), dtype=np.uint8), ())], "none of 1 images has a box"),
        ([TrainedImage(np.zeros((40, 40, 3), dtype=np.uint8), (BallBox(20, 20, 3, 3),))], "needs 4 px"),
        (
            [TrainedImage(np.full((40, 40, 3), 150, dtype=np.uint8), (BallBox(20, 20, 9, 9),))],
            "plain surface: contrast 0",
        ),
        (
            [TrainedImage(textured(10000), (BallBox(159.5, 119.5, 320, 240),))],
            "box at 160,120 in image 1 covers 100% of the image, allowed: 25% and less",
        ),
    ],
)
def test_what_teaches_nothing_is_refused(images, message):
    with pytest.raises(ValueError, match=message):
        teach(images)


def test_a_ball_is_found_before_what_it_was_not_taught_before(monkeypatch):
    """A grey ball, always before a light wall in the training images, hangs before their dark corner."""
    monkeypatch.setattr(teaching, "STEPS", 300)
    ball = teach([TrainedImage(image, (box,)) for image, box in (grey_ball(seed, 0) for seed in range(10000, 10004))])
    detector, hits, sightings = TrainedDetector(SETTINGS, ball), 0, 0
    for seed in range(10100, 10112):
        image, box = grey_ball(seed, 120)
        found = [one for one in detector.candidates(image) if one.score >= SETTINGS.score_min][:1]
        sightings += len(found)
        hits += sum(float(np.hypot(*(one.centre_px - [box.u_px, box.v_px]))) < box.radius_px for one in found)
    assert hits >= 10
    assert hits >= 0.9 * sightings


def grey_ball(seed, right_px):
    """An image that is light on the left and dark on the right, with a striped grey ball and its box."""
    rng = np.random.default_rng(seed)
    image = textured(4713, 240, 120) // 4
    image[:, :120] += np.uint8(170)
    centre = rng.uniform([25 + right_px, 25], [95 + right_px, 95])
    draw_ball(image, centre, 9.0, (105, 105, 105), stripe=(150, 150, 150), angle_deg=rng.uniform(0, 360))
    noisy = cv2.GaussianBlur(image, (0, 0), 1.0) + rng.normal(0, 4, image.shape)
    return np.clip(noisy, 0, 255).astype(np.uint8), BallBox(*centre, 18.0, 18.0)
