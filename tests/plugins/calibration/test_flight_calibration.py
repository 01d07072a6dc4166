"""Gravity, drag and wobble from flights, and the error of other flights predicted with them."""

import numpy as np
import pytest

from kendama_cli.plugins.calibration.flight_calibration import LEAST_SIGMA_M, NOMINAL, fit_flight_model
from kendama_cli.plugins.calibration.flight_search import RecordedFlight, find_flights
from kendama_cli.plugins.calibration.flight_trial import try_flights
from kendama_cli.vision.prediction.free_flight import FreeFlight, tilted_gravity
from kendama_cli.vision.settings import ColouredMotion
from tests.plugins.shared.flights import session


def flights(seed, throws, **options):
    track, _ = session(np.random.default_rng(seed), throws, **options)
    return find_flights([track])


def wobbling(seed, throws, wobble_m=4e-3, length_s=0.25):
    """Flights of 0.7 s at 150 Hz whose marker wobbles smoothly about them, in a frame that leans."""
    rng, made = np.random.default_rng(seed), []
    t = np.arange(0, 0.7, 1 / 150)
    d = np.sqrt(3) / length_s * np.abs(t[:, None] - t)
    factor = np.linalg.cholesky(wobble_m**2 * (1 + d) * np.exp(-d) + 1e-8 * np.eye(len(t)))
    for _ in range(throws):
        flight = FreeFlight(tilted_gravity(9.7, (0.02, -0.01)), 0.1)
        points = flight.position_m(np.zeros(3), np.array([*rng.uniform(-0.5, 0.5, 2), 3.0]), t)
        made.append(RecordedFlight("ball", 0.0, t, points + factor @ rng.standard_normal((len(t), 3))))
    return made


def test_gravity_is_found_in_size_and_lean():
    """Eight flights with 0.5 mm of noise: a flight's acceleration is known to 0.03 m/s^2, eight to 0.01."""
    true = FreeFlight(tilted_gravity(9.69, (0.01, -0.02)), 0.05)
    model = fit_flight_model(flights(10200, 8, rate_hz=300.0, flight=true))
    assert np.linalg.norm(model.gravity_m_s2 - true.gravity_m_s2) < 0.05
    assert np.abs(model.tilt_rad - [0.01, -0.02]).max() < 0.004
    assert model.sigma_m == pytest.approx(5e-4, rel=0.3)
    assert model.flights == 8


def test_wobble_is_told_from_noise():
    model = fit_flight_model(wobbling(10201, 8))
    assert isinstance(model.motion, ColouredMotion)
    assert 1e-3 < model.motion.sigma_m < 2e-2 or model.motion.intensity_m2_s3 > 3e-3
    quiet = fit_flight_model(flights(10202, 6))
    assert quiet.motion.sigma_m < 1e-3
    assert quiet.motion.intensity_m2_s3 < 3e-3


def test_calibrated_on_other_flights_a_wobbling_ball_is_predicted_better_than_by_standard_gravity():
    made = wobbling(10203, 10)
    halves = (0.5,)
    known = try_flights(made, halves, wobbling(10204, 6))
    nominal = try_flights(made, halves, [])
    assert np.median(known.position_error_mm) < 0.75 * np.median(nominal.position_error_mm)
    assert np.median(known.time_error_ms) < 0.75 * np.median(nominal.time_error_ms)
    assert nominal.model is NOMINAL


def test_every_flight_is_predicted_without_its_own_help():
    """Spoil one flight's own gravity: calibrated on the others, its error is large; on itself it would not be."""
    made = flights(10205, 4)
    wrong = made[2]
    bent = RecordedFlight("ball", wrong.begin_s, wrong.t_s, wrong.position_m + wrong.t_s[:, None] ** 2 * [0.5, 0, 0])
    spoilt = try_flights([*made[:2], bent, made[3]], (0.5,))
    assert spoilt.position_error_mm[2, 0] > 5 * np.median(spoilt.position_error_mm)
    alone = try_flights([bent], (0.5,), [])
    assert alone.model.flights == 0


def test_more_seen_of_a_flight_means_a_smaller_error():
    trial = try_flights(flights(10206, 4), (0.3, 0.5, 0.7))
    medians = np.median(trial.position_error_mm, axis=0)
    assert medians[0] > 1.5 * medians[2]
    assert np.isfinite(trial.time_error_ms).all()
    assert np.median(trial.position_error_mm[:, 1]) < 3.0


def test_the_same_flights_give_the_same_bytes():
    first, second = (try_flights(flights(10207, 3), (0.5,)) for _ in range(2))
    assert first.position_error_mm.tobytes() == second.position_error_mm.tobytes()
    assert first.model.gravity_m_s2.tobytes() == second.model.gravity_m_s2.tobytes()


def test_flights_without_any_noise_keep_a_floor_under_sigma():
    """Exact data: without a floor the likelihood grew without end, to a sigma of 1e-15 m."""
    made = []
    t_s = np.arange(0, 0.7, 1 / 200)
    for speed in np.linspace(2.6, 3.4, 2):
        points = FreeFlight(np.array([0.0, 0.0, -9.81]), 0.0).position_m(np.zeros(3), np.array([0.4, 0.0, speed]), t_s)
        made.append(RecordedFlight("ball", 0.0, t_s, points))
    model = fit_flight_model(made)
    assert model.sigma_m >= LEAST_SIGMA_M
    assert np.abs(model.gravity_m_s2 - (0, 0, -9.81)).max() < 0.01
    assert model.drag_per_s < 0.05
