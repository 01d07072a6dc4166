import numpy as np
import pytest
from scipy.integrate import solve_ivp

from kendama_cli.motion.dmp.primitive import settle, solve

FREQUENCY = 31.6


def drive(share):
    return np.column_stack((900 * np.sin(9 * share) + 400, 500 * np.cos(5 * share) * share))


def reference(share):
    def slope(s, state):
        y, v = state[:2], state[2:]
        return np.concatenate((v, drive(np.array([s]))[0] - 2 * FREQUENCY * v - FREQUENCY**2 * y))

    start = np.array([0.1, -0.2, 1.5, 0.0])
    return solve_ivp(slope, (0, 1), start, t_eval=share, rtol=1e-12, atol=1e-13, method="DOP853").y.T


def error(steps, share):
    made = solve(drive, np.array([0.1, -0.2]), np.array([1.5, 0.0]), FREQUENCY, steps).at(share)
    return np.abs(np.column_stack((made.position, made.rate)) - reference(share)).max()


def test_halving_the_step_divides_the_error_by_sixteen():
    share = np.linspace(0, 1, 17)  # nodes of every grid below
    errors = [error(steps, share) for steps in (64, 128, 256, 512)]
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    # a Runge-Kutta solution of order 4 comes to 4 from either side as w h goes from 0.5 to 0.06
    assert np.all(np.abs(orders - 4) < [0.6, 0.35, 0.2])


def test_between_the_nodes_the_solution_is_as_exact_as_on_them():
    share = np.random.default_rng(3).uniform(0, 1, 200).clip(0, 1)
    share.sort()
    assert error(512, share) < 2 * error(512, np.linspace(0, 1, 513))


def test_the_second_derivative_is_the_derivative_of_the_rate():
    solution = solve(drive, np.zeros(2), np.zeros(2), FREQUENCY, 1000)
    share = np.linspace(0.01, 0.99, 300)
    h = 1e-5
    slope = (solution.at(share + h).rate - solution.at(share - h).rate) / (2 * h)
    assert np.abs(slope - solution.at(share).second).max() < 1e-5 * np.abs(slope).max()


def test_settling_is_the_solution_without_drive():
    start, rate = np.array([-0.4]), np.array([2.0])
    share = np.linspace(0, 1, 50)
    exact = settle(start, rate, FREQUENCY, share)
    numeric = solve(lambda s: np.zeros((len(s), 1)), start, rate, FREQUENCY, 2000).at(share)
    for name in ("position", "rate", "second"):
        assert np.abs(getattr(exact, name) - getattr(numeric, name)).max() < 1e-7 * np.abs(getattr(exact, name)).max()


@pytest.mark.parametrize("frequency", [1.0, 31.6, 100.0])
def test_a_spring_without_drive_comes_to_rest_at_zero(frequency):
    made = settle(np.array([1.0]), np.array([0.0]), frequency, np.array([40.0 / frequency]))
    assert abs(made.position[0, 0]) < 1e-12
