import mpmath
import numpy as np
import pytest
from scipy.integrate import quad_vec, solve_ivp
from scipy.optimize import brentq

from kendama_cli.vision.prediction.free_flight import FreeFlight, tilted_gravity

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


@pytest.mark.parametrize("drag_per_s", [0.0, 0.5])
def test_a_flight_with_quadratic_drag_is_what_an_independent_integration_gives(drag_per_s):
    k2, velocity = 0.12, np.array([6.0, 0.4, 2.0])
    flight = FreeFlight(G, drag_per_s, k2)
    for way, ends in ((1.0, np.linspace(0.0, 0.6, 7)), (-1.0, np.array([0.04, 0.15]))):
        found = solve_ivp(
            lambda _, y, way=way: way
            * np.concatenate([y[3:], G - (drag_per_s + k2 * np.linalg.norm(y[3:])) * y[3:]]),
            (0, ends[-1]), np.concatenate([START, velocity]), t_eval=ends, rtol=1e-12, atol=1e-13,
        )  # fmt: skip
        position, speed = flight.moved(START, velocity, way * ends)
        assert np.abs(position - found.y[:3].T).max() < 2e-6
        assert np.abs(speed - found.y[3:].T).max() < 2e-5


@pytest.mark.parametrize("drag_per_s", [0.0, 1e-3, 0.3, 1.0, 1.5])
def test_the_gains_are_exact_to_the_last_digits_where_their_formula_would_cancel(drag_per_s):
    for s in (0.013, 0.02, 0.06, 0.3, 1.1):
        k, t = mpmath.mpf(drag_per_s), mpmath.mpf(s)
        with mpmath.workdps(40):
            first = (1 - mpmath.exp(-k * t)) / k if k else t
            second = (t - first) / k if k else t**2 / 2
        flight = FreeFlight(G, drag_per_s)
        assert float(flight.velocity_gain_s(s)) == pytest.approx(float(first), rel=1e-13, abs=0)
        assert float(flight.gravity_gain_s2(s)) == pytest.approx(float(second), rel=5e-12, abs=0)


@pytest.mark.parametrize("drag_per_s", [0.0, 0.7])
def test_the_change_with_the_velocity_is_the_integral_of_the_drag_s_slope(drag_per_s):
    """dv/dv0 = 1 - int S dt, dx/dv0 = s - int (s - t) S dt on the path without air, by adaptive quadrature."""
    k2, velocity = 0.12, np.array([6.0, 0.4, 2.0])

    def slope(t):
        v = velocity + t * G
        size = np.linalg.norm(v)
        return (drag_per_s + k2 * size) * np.eye(3) + k2 * np.outer(v, v) / size

    for s in (0.05, -0.1, 0.3):
        found = FreeFlight(G, drag_per_s, k2).transition(velocity, s)
        assert found.velocity == pytest.approx(np.eye(3) - quad_vec(slope, 0, s)[0], abs=1e-8)
        expected = s * np.eye(3) - quad_vec(lambda t, s=s: (s - t) * slope(t), 0, s)[0]
        assert found.position_s == pytest.approx(expected, abs=1e-8)
        linear, h = FreeFlight(G, drag_per_s), 1e-3
        exact = linear.transition(velocity, s)
        ways = [(linear.moved(START, velocity + h * e, s), linear.moved(START, velocity - h * e, s)) for e in np.eye(3)]
        for kind, matrix in enumerate(exact):
            assert matrix == pytest.approx(
                np.array([(up[kind] - low[kind]) / (2 * h) for up, low in ways]).T, abs=1e-10
            )


@pytest.mark.parametrize(("drag_per_s", "drag_per_m"), [(0.0, 0.0), (0.5, 0.0), (0.0, 0.1), (0.5, 0.1)])
def test_a_height_is_crossed_downward_where_a_search_between_the_apex_and_far_below_finds_it(drag_per_s, drag_per_m):
    flight, rng = FreeFlight(G, drag_per_s, drag_per_m), np.random.default_rng(5)
    for _ in range(40):
        velocity = np.array([*rng.normal(0, 2, 2), rng.uniform(0, 3)])

        def at(s, kind, velocity=velocity):
            return flight.moved(START, velocity, s)[kind][2]

        apex = brentq(at, -0.25, 1.0, args=(1,))
        top = at(apex, 0)
        above = rng.choice([1e-3, 0.02, -0.02, -1.0]) * rng.uniform()
        found = flight.descent_s(START, velocity, top + above)
        if above > 0:
            assert found is None
        else:
            assert found > apex
            assert at(found, 0) == pytest.approx(top + above, abs=1e-12)
    assert FreeFlight(-G, 0.1).descent_s(START, VELOCITY, 0.0) is None
    assert FreeFlight(G / 20, 0.0).descent_s(START, np.zeros(3), 0.3 - 9.81 / 40) == pytest.approx(1.0)


def test_gravity_leans_by_its_two_angles_and_keeps_its_size():
    for tilt in ((0.0, 0.0), (0.1, 0.0), (-0.05, 0.2)):
        x, y, z = tilted_gravity(9.8, tilt)
        assert np.linalg.norm([x, y, z]) == pytest.approx(9.8)
        assert (np.arctan2(x, -z), np.arctan2(y, -z)) == pytest.approx(tilt)


def test_how_a_flight_changes_with_its_velocity_is_right_to_first_order_of_the_air():
    """Over a step of a filter; what is left is the air's second order, (k |v| s)^2 of the derivative."""
    flight, velocity, s = FreeFlight(G, 0.0, 0.12), np.array([6.0, 0.4, 2.0]), 0.02
    changes = flight.transition(velocity, s)
    for axis in range(3):
        step = 1e-4 * np.eye(3)[axis]
        after, before = flight.moved(START, velocity + step, s), flight.moved(START, velocity, s)
        assert np.abs(changes.position_s[:, axis] - (after[0] - before[0]) / 1e-4).max() < 1e-3 * s
        assert np.abs(changes.velocity[:, axis] - (after[1] - before[1]) / 1e-4).max() < 1e-3


def test_negative_drag_is_refused():
    with pytest.raises(ValueError, match="drag_per_s must not be negative"):
        FreeFlight(G, -0.1)


@pytest.mark.parametrize("drag_per_s", [0.0, 0.04, 3.0])
def test_one_time_alone_gives_the_same_gains_as_an_array(drag_per_s):
    flight, s = FreeFlight(np.array([0.0, 0.0, -9.81]), drag_per_s), np.array([-0.1, 0.0, 1e-4, 0.3, 2.0])
    one = np.array([flight.position_m(START, VELOCITY, float(moment)) for moment in s])
    assert np.allclose(one, flight.position_m(START, VELOCITY, s), rtol=1e-13, atol=1e-16)
