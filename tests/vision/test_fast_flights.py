"""Fast balls in air: drag with the square of the speed, and spin, against flights that scipy integrated."""

import dataclasses

import numpy as np
import pytest

from kendama_cli.vision.air_path import AirPath, fit_air
from kendama_cli.vision.flight_calibration import NOMINAL, fit_flight_model
from kendama_cli.vision.flight_search import RecordedTrack, find_flights
from kendama_cli.vision.flight_trial import predict_end, try_flights
from kendama_cli.vision.free_flight import FreeFlight
from kendama_cli.vision.settings import ColouredMotion
from tests.vision.fast_flights import DRAG_PER_M, flown, rally

START, VELOCITY, SPIN = np.array([-1.3, 0.1, 0.4]), np.array([6.0, 0.4, 2.0]), np.array([0.2, -0.5, 0.3])
T_S = np.linspace(0, 0.6, 61)
GRAVITY = NOMINAL.gravity_m_s2
HALF = np.array([0.5])


def test_a_flight_with_drag_and_spin_is_what_an_independent_integration_gives():
    flight = FreeFlight(np.array([0, 0, -9.81]), 0.0, DRAG_PER_M, tuple(SPIN))
    places, speeds = flown(START, VELOCITY, SPIN, T_S)
    assert np.abs(flight.position_m(START, VELOCITY, T_S) - places).max() < 1e-6
    assert np.abs(flight.velocity_m_s(VELOCITY, T_S) - speeds).max() < 1e-5
    crossing_s = flight.descent_s(START, VELOCITY, 0.2)
    assert flown(START, VELOCITY, SPIN, np.array([0, crossing_s]))[0][-1, 2] == pytest.approx(0.2, abs=1e-6)


def test_how_a_flight_changes_with_its_velocity_and_spin_is_right_to_first_order_of_the_air():
    """Over a step of a filter; what is left is the air's second order, (k |v| s)^2 of the derivative."""
    flight, s = FreeFlight(np.array([0, 0, -9.81]), 0.0, DRAG_PER_M, tuple(SPIN)), 0.02
    by_velocity, by_spin = flight.transition(VELOCITY, s), flight.transition_by_spin(VELOCITY, s)
    for axis in range(3):
        step = 1e-4 * np.eye(3)[axis]
        place, speed = (
            (after - before) / 1e-4
            for after, before in zip(
                flight.moved(START, VELOCITY + step, s), flight.moved(START, VELOCITY, s), strict=True
            )
        )
        assert np.abs(by_velocity.position_s[:, axis] - place).max() < 1e-3 * s
        assert np.abs(by_velocity.velocity[:, axis] - speed).max() < 1e-3
        spun = dataclasses.replace(flight, spin_per_s=tuple(SPIN + step))
        place, speed = (
            (after - before) / 1e-4
            for after, before in zip(spun.moved(START, VELOCITY, s), flight.moved(START, VELOCITY, s), strict=True)
        )
        assert np.abs(by_spin.position_s[:, axis] - place).max() < 0.03 * np.abs(by_spin.position_s).max()
        assert np.abs(by_spin.velocity[:, axis] - speed).max() < 0.03 * np.abs(by_spin.velocity).max()


def test_a_path_without_its_air_is_a_parabola():
    places, speeds = flown(START, VELOCITY, SPIN, T_S)
    path = AirPath.along(T_S, speeds)
    straight = places + DRAG_PER_M * path.drag_m2 - path.spin_ms @ SPIN
    assert np.abs(straight - START - T_S[:, None] * VELOCITY - T_S[:, None] ** 2 / 2 * [0, 0, -9.81]).max() < 2e-4


def test_drag_and_spins_are_found_together():
    """Twelve flights with 1 mm of noise."""
    rng, spins = np.random.default_rng(10850), np.random.default_rng(10851).normal(0, 0.3, (12, 3))
    flights = []
    for spin in spins:
        velocity = VELOCITY * rng.uniform(0.7, 1.3) + rng.normal(0, 0.3, 3)
        flights.append((T_S, flown(START, velocity, spin, T_S)[0] + 1e-3 * rng.standard_normal((len(T_S), 3))))
    air = fit_air(flights, GRAVITY, 0.3)
    assert air.drag_per_m == pytest.approx(DRAG_PER_M, abs=0.01)
    assert air.spin_sigma_per_s == pytest.approx(0.3, abs=0.12)
    across = np.cross(VELOCITY, np.cross(air.spin_per_s - spins, VELOCITY)) / (VELOCITY @ VELOCITY)
    assert np.sqrt((across**2).mean()) < 0.1  # along the way spin does nothing


@pytest.mark.parametrize(("spin_sigma_per_s", "spin"), [(0.0, False), (0.3, True)])
def test_every_stroke_of_a_rally_is_a_flight_that_ends_at_the_table(spin_sigma_per_s, spin):
    for seed in range(10852, 10856):
        track, strokes = rally(seed, spin_sigma_per_s=spin_sigma_per_s)
        flights = find_flights([track], spin=spin)
        assert len(flights) == strokes
        for flight in flights:
            assert flight.position_m[-1, 2] < 0.15
            assert flight.position_m[:, 2].argmin() >= len(flight.t_s) - 3  # nothing of the bounce


def test_what_a_hand_does_is_no_flight_of_a_spinning_ball():
    t = np.arange(0, 10, 1 / 120)
    hand = np.column_stack([0.5 * np.sin(6 * t), 0.3 * np.cos(5 * t), 0.3 * np.sin(7 * t)])
    assert find_flights([RecordedTrack("hand", t, hand)], spin=True) == []


def strokes(seeds, spin_sigma_per_s):
    found = [find_flights([rally(seed, spin_sigma_per_s=spin_sigma_per_s)[0]], spin=True) for seed in seeds]
    return [flight for flights in found for flight in flights]


def test_half_a_spinning_flight_foretells_its_end_better_where_spin_is_in_the_model():
    motion = ColouredMotion("coloured", 1e-4, 0.1, 1e-3)
    plain = dataclasses.replace(NOMINAL, drag_per_m=DRAG_PER_M, motion=motion)
    spinning = dataclasses.replace(plain, spin_sigma_per_s=0.3)
    errors = np.array(
        [
            [predict_end(flight, model, HALF)[0, 0] for model in (plain, spinning)]
            for flight in strokes(range(10860, 10863), 0.3)
        ]
    )
    assert np.median(errors[:, 1]) < 0.5 * np.median(errors[:, 0])


@pytest.mark.slow
def test_fast_flights_foretell_others_by_what_they_say_of_the_air():
    """The null model knows gravity alone."""
    known = fit_flight_model(strokes(range(10870, 10876), 0.0))
    assert known.drag_per_m == pytest.approx(DRAG_PER_M, abs=0.01)
    flights = strokes(range(10876, 10882), 0.0)
    errors = [np.median(try_flights(flights, (0.5,), one).position_error_mm) for one in (flights[:6], [])]
    assert errors[0] < 0.2 * errors[1]
