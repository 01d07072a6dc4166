"""A taught ball that learns on from the film in which it is sought."""

import numpy as np
import pytest

from kendama_cli.plugins.films import self_training
from kendama_cli.plugins.films.ball_box import BallBox, TrainedImage
from kendama_cli.plugins.films.image_track import track
from kendama_cli.plugins.films.self_training import trained_on_film
from kendama_cli.plugins.films.settings import TrainedDetectorSettings
from kendama_cli.plugins.films.trained_detector import TrainedDetector
from kendama_cli.plugins.films.training import teach
from kendama_cli.vision.detection.interface import Sighting
from tests.vision.ball_films import draw_ball, labelled_image, pendulum, textured

STRIPED = (np.arange(160) // 6 % 2).astype(bool)
FRAMES = [np.tile(np.where(STRIPED, 250, number).astype(np.uint8)[:, None], (120, 1, 3)) for number in range(40)]
OWN = TrainedImage(FRAMES[0], (BallBox(30.0, 30.0, 12.0, 12.0),))
BALL, STONE = (lambda k: (20.0 + 5 * k, 30.0)), (lambda k: (100.0, 90.0))


class Told:
    """Sees what it is told to, at places of the frame's number."""

    def __init__(self, places, score=0.9):
        self.places, self.score = places, score

    def candidates(self, pixels, origin_px=(0, 0), hint=None):
        for place in self.places:
            yield Sighting(np.array(place(int(pixels[0, 0, 0]))), np.eye(2), 6.0, self.score)


@pytest.fixture(autouse=True)
def no_region(monkeypatch, request):
    """What is told to be seen has no colours: sightings stay where they are."""
    if request.node.get_closest_marker("slow") is None:
        monkeypatch.setattr(self_training, "learn_region", lambda images, seen: None)


def taught_with(monkeypatch, places_of_ball):
    """The images that each round teaches, where a ball of that number is seen at those places; and the ball chosen."""
    rounds = []

    def detector(ball):
        told = Told(places_of_ball(ball))
        told.ball = ball
        return told

    def note(images, seed):
        rounds.append(images)
        return len(rounds)

    monkeypatch.setattr(self_training, "teach", note)
    return rounds, trained_on_film([OWN], 0, FRAMES, detector, threshold=0.5).ball


def test_sightings_that_move_are_taught_as_boxes_in_their_frames(monkeypatch):
    rounds, best = taught_with(monkeypatch, lambda ball: [BALL])
    assert best == self_training.ROUNDS
    own, *shown = rounds[0]
    assert own is OWN
    assert len(shown) == self_training.MOST
    numbers = sorted(int(one.pixels[0, 0, 0]) for one in shown)
    assert min(np.diff(numbers)) >= self_training.APART_FRAMES
    for one in shown:
        (box,) = one.boxes
        assert (box.u_px, box.v_px) == BALL(int(one.pixels[0, 0, 0]))
        assert box.radius_px == 6.0


def test_what_stands_still_teaches_that_it_is_no_ball(monkeypatch):
    rounds, best = taught_with(monkeypatch, lambda ball: [STONE] if ball == 0 else [BALL])
    (_, background), (_, *shown), _ = rounds
    assert background.boxes == ()
    assert background.pixels[0, 0, 0] == 19  # the median of 0 to 39
    assert len(shown) == self_training.MOST
    assert best == self_training.ROUNDS


def test_a_ball_that_rests_stays_as_it_was_taught(monkeypatch):
    _, best = taught_with(monkeypatch, lambda ball: [STONE])
    assert best == 0


def refused_where(monkeypatch, is_refused):
    """The ball, where teaching refuses sets of images; it takes no box for odd."""

    def refuse(images, seed):
        if is_refused(images):
            raise ValueError("the box shows something else than the others")
        return len(images)

    monkeypatch.setattr(self_training, "teach", refuse)
    monkeypatch.setattr(self_training, "odd_images", lambda images, seed: {len(images) - 1: 0.2})
    found = []

    def detector(ball):
        found.append(ball)
        return Told([BALL])

    trained_on_film([], 0, FRAMES, detector, threshold=0.5)
    return found


def test_a_sighting_that_teaching_refuses_is_left_out(monkeypatch):
    found = refused_where(monkeypatch, lambda images: len(images) == self_training.MOST)
    assert found[-1] == self_training.MOST - 1


def test_sightings_that_teaching_refuses_without_the_odd_ones_too_end_it(monkeypatch):
    assert refused_where(monkeypatch, lambda images: True) == [0, 0]


def test_a_sighting_on_a_plain_surface_is_not_taught(monkeypatch):
    some = [np.full_like(frame, number) if number % 4 else frame for number, frame in enumerate(FRAMES)]
    shown = []
    monkeypatch.setattr(self_training, "teach", lambda images, seed: shown.append(images))
    trained_on_film([], 0, some, lambda ball: Told([BALL]), threshold=0.5)
    striped = [one.pixels.std() > 0 for one in shown[0] if one.boxes]
    assert striped
    assert all(striped)


@pytest.mark.slow
def test_on_a_background_that_no_box_has_shown_a_swing_is_placed_to_a_tenth_of_the_radius():
    """Dark discs of the ball's size hang about, and the light is another."""
    images = []
    for seed in range(10000, 10005):
        image, (u, v, width, height) = labelled_image(seed)
        images.append(TrainedImage(image, (BallBox(u, v, width, height),)))
    background = textured(10077)
    for place in ((60, 60), (250, 120), (120, 200), (200, 40)):
        draw_ball(background, place, 10.0, (70, 75, 80), stripe=(60, 90, 120), angle_deg=20.0)
    frames, truth = pendulum(
        40, 10000, background=background, radius_px=10.0, colour=(60, 60, 65), stripe=(40, 120, 235)
    )
    settings = TrainedDetectorSettings("trained", "", 20, 0.5, 1)

    def hits(detector):
        seen = track([list(detector.candidates(pixels))[:6] for pixels in frames], 0.5)
        return sum(one is not None and np.hypot(*(one.sighting.centre_px - truth[one.frame])) < 1.0 for one in seen)

    ball = teach(images)
    after = trained_on_film(
        images, ball, frames, lambda one: TrainedDetector(settings, one), threshold=settings.score_min
    )
    assert hits(TrainedDetector(settings, ball)) < hits(after)
    assert hits(after) >= 39
