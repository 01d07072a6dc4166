"""Cameras that expose line after line: what is seen counts at its own line's time."""

from dataclasses import replace

import numpy as np
import pytest

from kendama_cli.plugins.films.film_positions import clock_offsets, from_several
from kendama_cli.vision.cameras.camera_model import looking_at
from tests.plugins.films.rolling import filmed, seen_px, throws
from tests.vision import followed_flight
from tests.vision.followed_flight import flight, sighting, tracker


def cameras(readout_s):
    """The right one looks down, so that it sees the ball in other rows than the left one."""
    left, right = followed_flight.CAMERAS
    place = np.array([0.5, -1.3, 0.9])
    high = replace(right, position_in_world_m=place, world_to_camera=looking_at(place, (0.0, 0.0, 0.1)))
    return [replace(one, readout_s=readout_s) for one in (left, high)]


def test_rows_are_dated_from_the_middle_one():
    one = replace(followed_flight.CAMERAS[0], readout_s=0.024)
    assert one.row_s == pytest.approx(50e-6)
    assert one.exposed_s([1.0, 2.0, 3.0], [[0, 239.5], [5, 479], [9, 0]]) == pytest.approx([1.0, 2.011975, 2.988025])
    assert followed_flight.CAMERAS[0].exposed_s(0.1, [3.0, 77.3]) == 0.1


def test_each_sighting_counts_at_its_own_time(monkeypatch):
    """A readout of 30 ms at 30 images/s, half seen, without noise: 0.02 mm, and 3.4 mm where it is ignored, median."""
    made = cameras(0.030)
    monkeypatch.setattr(followed_flight, "CAMERAS", made)
    errors = []
    for seed in range(10680, 10688):
        _, release = flight(seed)
        knows, ignores = tracker(onset=False), tracker(onset=False)
        for frame_s in np.arange(0.02, 0.5 * release.crossing_s, 1 / 30):
            seen = {one.name: sighting(seen_px(one, release.ball_m, frame_s), 0.05) for one in made}
            own = {one.name: float(one.exposed_s(frame_s, seen[one.name].centre_px)) for one in made}
            pose = knows.update(frame_s, seen, release.tie_m(frame_s), own)
            null = ignores.update(frame_s, seen, release.tie_m(frame_s))
        errors.append([np.linalg.norm(one.position_m - release.crossing_m) for one in (pose, null)])
    known, ignored = np.median(np.array(errors), axis=0)
    assert known < 1e-4
    assert ignored > 1e-3


def blind(made):
    return [replace(one, readout_s=0.0) for one in made]


def test_a_track_of_rolling_shutters_is_where_the_ball_is_at_its_own_times():
    rng = np.random.default_rng(10655)
    made, thrown = cameras(0.030), throws(rng, 2)
    films = filmed(made, thrown, rng, sigma_px=0.1)
    off = []
    for known in (made, blind(made)):
        timed = [one.exposed(camera) for one, camera in zip(films, known, strict=True)]
        places = from_several(timed, known, clock_offsets(timed, known))
        flying = [
            np.linalg.norm(place - thrown.ball_m(t_s))
            for t_s, place in zip(places.t_s, places.position_m, strict=True)
            if ((thrown.begin_s + 0.04 < t_s) & (t_s < thrown.begin_s + thrown.flown_s - 0.04)).any()
        ]
        off.append(float(np.quantile(flying, 0.95)))
    assert off[0] < 0.004
    assert off[1] > 4 * off[0]
