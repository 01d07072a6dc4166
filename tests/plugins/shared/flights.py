"""Recorded tracks of our own making: throws with a hand before and a catch after."""

import numpy as np

from kendama_cli.plugins.shared.recordings.reader import RecordedTrack
from kendama_cli.vision.prediction.free_flight import FreeFlight

GRAVITY = np.array([0.0, 0.0, -9.81])


def throw(rng, *, rate_hz=120.0, sigma_m=5e-4, held_s=0.3, flight=None, last_s=None):
    """Times and positions of a ball that lies still, flies, and lies still again; and the flight's duration."""
    flight = flight or FreeFlight(GRAVITY, 0.05)
    velocity = np.array([rng.uniform(-0.6, 0.6), rng.uniform(-0.3, 0.3), rng.uniform(1.3, 2.5)])
    start = np.array([0.1, 0.0, 0.8])
    last = last_s or flight.descent_s(start, velocity, 0.75)
    t = np.arange(-held_s, last + held_s, 1 / rate_hz)
    points = flight.position_m(start, velocity, np.clip(t, 0, last))
    return t, points + sigma_m * rng.standard_normal(points.shape), last


def session(rng, throws, **options):
    """One track with many throws, and the begin and duration of each."""
    times, places, truth, begin = [], [], [], 0.5
    for _ in range(throws):
        t, points, last = throw(rng, **options)
        times.append(t + begin)
        places.append(points)
        truth.append((begin, last))
        begin += last + 2.0
    return RecordedTrack("ball", np.concatenate(times), np.concatenate(places)), truth
