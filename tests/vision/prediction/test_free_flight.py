import numpy as np
import pytest
from scipy.integrate import solve_ivp

from kendama_cli.vision.prediction.free_flight import FreeFlight

G = np.array([0.1, -0.05, -9.81])
START, VELOCITY = np.array([0.1, 0.0, 0.3]), np.array([-0.8, 0.1, 1.6])


@pytest.mark.parametrize("drag_per_s", [0.0, 1e-9, 0.04, 0.3, 5.0])
def test_closed_form_agrees_with_integration_of_the_equation(drag_per_s):
    flight = FreeFlight(G, drag_per_s)
    ends = np.array([0.01, 0.2, 0.7])
    found = solve_ivp(
        lambda _, y: np.concatenate([y[3:], G - drag_per_s * y[3:]]),
        (0, 0.7), np.concatenate([START, VELOCITY]), t_eval=ends, rtol=1e-12, atol=1e-13,
    )  # fmt: skip
    assert np.abs(flight.position_m(START, VELOCITY, ends) - found.y[:3].T).max() < 1e-10
    assert np.abs(flight.moved(np.zeros(3), VELOCITY, ends)[1] - found.y[3:].T).max() < 1e-10


def test_a_flight_with_quadratic_drag_is_what_an_independent_integration_gives():
    k2, velocity, ends = 0.12, np.array([6.0, 0.4, 2.0]), np.linspace(0.0, 0.6, 7)
    found = solve_ivp(
        lambda _, y: np.concatenate([y[3:], G - k2 * np.linalg.norm(y[3:]) * y[3:]]),
        (0, 0.6), np.concatenate([START, velocity]), t_eval=ends, rtol=1e-12, atol=1e-13,
    )  # fmt: skip
    flight = FreeFlight(G, 0.0, k2)
    assert np.abs(flight.position_m(START, velocity, ends) - found.y[:3].T).max() < 1e-6
    assert np.abs(flight.moved(np.zeros(3), velocity, ends)[1] - found.y[3:].T).max() < 1e-5


def test_how_a_flight_changes_with_its_velocity_is_right_to_first_order_of_the_air():
    """Over a step of a filter; what is left is the air's second order, (k |v| s)^2 of the derivative."""
    flight, velocity, s = FreeFlight(G, 0.0, 0.12), np.array([6.0, 0.4, 2.0]), 0.02
    changes = flight.transition(velocity, s)
    for axis in range(3):
        step = 1e-4 * np.eye(3)[axis]
        after, before = flight.moved(START, velocity + step, s), flight.moved(START, velocity, s)
        assert np.abs(changes.position_s[:, axis] - (after[0] - before[0]) / 1e-4).max() < 1e-3 * s
        assert np.abs(changes.velocity[:, axis] - (after[1] - before[1]) / 1e-4).max() < 1e-3


@pytest.mark.parametrize("drag_per_s", [0.0, 0.04, 2.0])
def test_descent_is_on_the_plane_and_downward(drag_per_s):
    flight = FreeFlight(G, drag_per_s)
    s = flight.descent_s(START, VELOCITY, 0.25)
    assert s is not None
    assert abs(flight.position_m(START, VELOCITY, s)[2] - 0.25) < 1e-12
    assert flight.moved(np.zeros(3), VELOCITY, s)[1][2] < 0


def test_a_plane_above_the_apex_is_never_crossed():
    assert FreeFlight(G, 0.0).descent_s(START, VELOCITY, 0.3 + 1.6**2 / 19.62 + 1e-6) is None
    near = 0.3 + 1.6**2 / 19.62 - 1e-3  # within reach without drag, out of reach with it
    assert FreeFlight(G, 0.0).descent_s(START, VELOCITY, near) is not None
    assert FreeFlight(G, 1.0).descent_s(START, VELOCITY, near) is None


def test_negative_drag_is_refused():
    with pytest.raises(ValueError, match="drag_per_s must not be negative"):
        FreeFlight(G, -0.1)


@pytest.mark.parametrize("drag_per_s", [0.0, 0.04, 3.0])
def test_one_time_alone_gives_the_same_gains_as_an_array(drag_per_s):
    flight, s = FreeFlight(np.array([0.0, 0.0, -9.81]), drag_per_s), np.array([-0.1, 0.0, 1e-4, 0.3, 2.0])
    one = np.array([flight.position_m(START, VELOCITY, float(moment)) for moment in s])
    assert np.allclose(one, flight.position_m(START, VELOCITY, s), rtol=1e-13, atol=1e-16)
