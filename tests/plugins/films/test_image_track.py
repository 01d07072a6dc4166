"""The ball is chosen among candidates by its motion: clutter that stands still is not taken for it."""

import numpy as np
import pytest

from kendama_cli.plugins.films.ball_film import track
from kendama_cli.vision.detection.interface import Sighting

RADIUS_PX = 10.0


def sighting(place, score):
    return Sighting(np.array(place, dtype=float), np.eye(2), RADIUS_PX, score)


def swing(frames, seed, at_rest=0):
    """A ball (frames, 2) that rests and then swings by 1.2 s at 30 images a second."""
    t_s = np.maximum(np.arange(frames) - at_rest, 0) / 30.0
    angle = 0.8 * np.sin(2 * np.pi * t_s / 1.2)
    noise = np.random.default_rng(seed).normal(0, 0.1 * RADIUS_PX, (frames, 2))
    return np.array([240.0, 100.0]) + 200.0 * np.stack([np.sin(angle), np.cos(angle)], axis=1) + noise


def chosen(film, threshold=0.5):
    return [None if one is None else one.sighting.centre_px for one in track(film, threshold)]


@pytest.mark.parametrize("seed", range(10620, 10623))
def test_bright_clutter_that_stands_still_is_not_the_ball(seed):
    rng, ball = np.random.default_rng(seed), swing(60, seed)
    film = []
    for place in ball:
        clutter = [sighting(rng.normal([380.0, 90.0], 1.5), 1.0), sighting((400.0, 110.0), 0.9)]
        film.append(clutter + ([sighting(place, 0.4)] if rng.random() < 0.8 else []))
    found = chosen(film)
    assert all(one is None or np.hypot(*(one - place)) < 1 for one, place in zip(found, ball, strict=True))
    assert sum(one is not None for one in found) >= 40


def test_a_ball_that_rests_for_most_of_a_film_is_seen_all_the_time():
    ball = swing(90, 10630, at_rest=60)
    found = chosen([[sighting(place, 0.8)] for place in ball])
    assert all(one is not None for one in found)


def test_a_ball_that_only_hangs_is_seen():
    film = [[sighting((240.0, 300.0), 0.8)] for _ in range(40)]
    assert all(one is not None for one in chosen(film))
