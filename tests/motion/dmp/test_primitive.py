from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from kendama_cli.artifacts.demonstration import Demonstration
from kendama_cli.motion.dmp.averaging import Encoding, encode, encode_demonstrations, prepare
from kendama_cli.motion.dmp.basis import activations, centers_equal_in_time, features, phase, widths_by_spacing
from kendama_cli.motion.dmp.primitive import (
    ROLL_OUT,
    covariance,
    forcing,
    goal_path,
    parameters,
    play,
    sample_plan,
    settle,
    solve,
    with_parameters,
)
from tests.motion.swings import demonstration, path, settings


@pytest.fixture(scope="module")
def plan():
    return encode_demonstrations([demonstration()], settings())


@pytest.fixture(scope="module")
def moving_plan(plan):
    return dataclasses.replace(plan, start_velocity_m_s=np.array([0.4, -0.1, 0.2]))


@pytest.fixture(scope="module")
def hitting_plan():
    """A swing cut while it moves at both ends."""
    t = np.arange(0.5, 1.2, 0.01)
    return encode_demonstrations([Demonstration("cut", t, path(t))], settings())


def test_playing_solves_the_papers_equations(moving_plan):
    """Equations 3 to 5 as they stand, integrated by another library; f = 0 after tau, though the goal is missed."""
    plan = dataclasses.replace(moving_plan, tau_scale=1.3, weights=moving_plan.weights + 100.0)
    tau = plan.tau_scale * plan.duration_s
    damping = 2 * np.sqrt(plan.stiffness)

    def slope(t, state):
        y, v, x = state[:3], state[3:6], state[6]
        psi = np.exp(-((x - plan.centers) ** 2) / (2 * plan.widths**2))
        f = x * (plan.weights @ psi) / psi.sum() if t <= tau else 0.0
        rate = (plan.stiffness * (plan.goal_m - y) - damping * v + f) / tau
        return np.concatenate((v / tau, rate, [-plan.phase_decay * x / tau]))

    start = np.concatenate((plan.start_m, plan.start_velocity_m_s * plan.duration_s, [1.0]))
    legs, t_s = [], tau * np.linspace(0, 1.5, 151)
    for times in (t_s[:101], np.append(tau * (1 + 1e-15), t_s[101:])):
        span = (times[0], times[-1])
        legs.append(solve_ivp(slope, span, start, t_eval=times, rtol=1e-11, atol=1e-12, method="DOP853").y.T)
        start = legs[-1][-1]
    exact = np.vstack((legs[0], legs[1][1:]))
    made = play(plan, t_s)
    assert np.abs(made.position_m[100] - plan.goal_m).max() > 0.01
    assert np.abs(made.position_m - exact[:, :3]).max() < 1e-8
    assert np.abs(made.velocity_m_s - exact[:, 3:6] / tau).max() < 1e-7


def test_a_larger_tau_scale_is_the_same_path_slower(moving_plan):
    t_s = np.linspace(-0.1, 3.0, 400)
    slow = dataclasses.replace(moving_plan, tau_scale=1.25)
    fast, slowed = play(moving_plan, t_s), play(slow, 1.25 * t_s)
    assert np.allclose(slowed.position_m, fast.position_m, atol=1e-12)
    assert np.allclose(slowed.velocity_m_s, fast.velocity_m_s / 1.25, atol=1e-11)
    assert np.allclose(slowed.acceleration_m_s2, fast.acceleration_m_s2 / 1.25**2, atol=1e-10)


def test_velocity_and_acceleration_are_derivatives_of_the_position(plan):
    t_s = np.linspace(0.01, plan.duration_s - 0.01, 300)
    h = 1e-5
    ahead, here, past = (play(plan, t_s + shift) for shift in (h, 0, -h))
    assert np.abs((ahead.position_m - past.position_m) / (2 * h) - here.velocity_m_s).max() < 1e-6
    assert np.abs((ahead.velocity_m_s - past.velocity_m_s) / (2 * h) - here.acceleration_m_s2).max() < 1e-4


def test_any_spacing_of_the_instants_gives_the_same_motion(plan):
    t_s = np.linspace(0, 3.0, 301)
    shuffled = np.random.default_rng(1).permutation(301)
    assert np.array_equal(play(plan, t_s[shuffled]).position_m, play(plan, t_s).position_m[shuffled])


def test_before_the_start_the_motion_rests_there(moving_plan):
    made = play(moving_plan, np.array([-5.0, -1e-9]))
    assert np.array_equal(made.position_m, np.tile(moving_plan.start_m, (2, 1)))
    assert not made.velocity_m_s.any()
    assert not made.acceleration_m_s2.any()


def test_a_goal_that_moves_is_met_with_its_velocity(hitting_plan):
    """The equations with a moving goal, integrated by another library, and where they lead."""
    plan = hitting_plan
    tau, damping = plan.duration_s, 2 * np.sqrt(plan.stiffness)
    goal_rate = plan.goal_velocity_m_s * tau

    def slope(s, state):
        y, v = state[:3], state[3:]
        goal = plan.goal_m + goal_rate * (s - 1)
        f = forcing(plan, np.array([s]))[0]
        return np.concatenate((v, plan.stiffness * (goal - y) + damping * (goal_rate - v) + f))

    start = np.concatenate((plan.start_m, plan.start_velocity_m_s * tau))
    fraction = np.linspace(0, 1, 51)
    exact = solve_ivp(slope, (0, 1), start, t_eval=fraction, rtol=1e-11, atol=1e-12, method="DOP853").y.T
    made = play(plan, fraction * tau)
    assert np.abs(made.position_m - exact[:, :3]).max() < 1e-8
    assert np.abs(made.velocity_m_s - exact[:, 3:] / tau).max() < 1e-7
    assert np.abs(made.position_m[-1] - plan.goal_m).max() < 1e-5
    assert np.abs(made.velocity_m_s[-1] - plan.goal_velocity_m_s).max() < 1e-3


def test_a_moving_goal_rolls_out_as_its_rate_says():
    """Rate g' (1 - u)^2 (1 + 2 u) after the end, over ROLL_OUT of the motion; even before, at rest after."""
    goal, rate = np.array([0.3, -1.0]), np.array([2.0, 0.7])
    u = np.polynomial.Polynomial([0.0, 1.0])
    slowing = (1 - u) ** 2 * (1 + 2 * u)
    share = np.array([0.0, 0.4, 1.0, *(1 + ROLL_OUT * np.linspace(0, 1, 6)), 3.0])
    made = goal_path(share, goal, rate)
    for s, position, speed, second in zip(share, made.position, made.rate, made.second, strict=True):
        at = min(max((s - 1) / ROLL_OUT, 0.0), 1.0)
        assert position == pytest.approx(goal + rate * (min(s - 1, 0.0) + ROLL_OUT * slowing.integ()(at)))
        assert speed == pytest.approx(rate * slowing(at))
        assert second == pytest.approx(rate * slowing.deriv()(at) / ROLL_OUT)


def test_a_motion_that_ends_moving_comes_to_rest_smoothly_and_stays(hitting_plan):
    tau = hitting_plan.duration_s
    t_s = tau * (1 + np.linspace(0, 1, 2001))
    made = play(hitting_plan, t_s)
    speed = np.linalg.norm(made.velocity_m_s, axis=1)
    end_speed = np.linalg.norm(hitting_plan.goal_velocity_m_s)
    assert speed.max() < 1.02 * end_speed
    # the roll-out's own deceleration is 1.5 v / its time; what is left of the motion's end adds little
    assert np.linalg.norm(made.acceleration_m_s2, axis=1)[50:].max() < 2 * 1.5 * end_speed / (ROLL_OUT * tau)
    rest = hitting_plan.goal_m + hitting_plan.goal_velocity_m_s * tau * ROLL_OUT / 2
    late = play(hitting_plan, tau * np.array([2.0, 10.0, 1e4])).position_m
    assert np.abs(late - rest).max() < 1e-9


def test_a_shifted_goal_moves_the_end_and_leaves_the_start(plan):
    shift = np.array([0.05, 0.0, -0.03])
    moved = dataclasses.replace(plan, goal_m=plan.goal_m + shift)
    t_s = np.array([0.0, plan.duration_s])
    difference = play(moved, t_s).position_m - play(plan, t_s).position_m
    assert np.abs(difference[0]).max() == 0
    assert np.abs(difference[1] - shift).max() < 1e-6


def test_the_phase_falls_from_one_as_its_equation_says():
    fraction = np.linspace(0, 1, 1001)
    x = phase(fraction, 2.0)
    assert x[0] == 1.0
    assert np.abs(np.gradient(x, fraction)[1:-1] + 2.0 * x[1:-1]).max() < 1e-5


def test_features_are_shares_of_the_phase():
    centers = centers_equal_in_time(20, 2.0)
    x = phase(np.linspace(0, 1, 99), 2.0)
    made = features(x, centers, widths_by_spacing(centers, 1.0))
    assert np.allclose(made.sum(axis=1), x)
    assert (made >= 0).all()


def test_a_function_is_one_at_its_centre_and_falls_by_its_width():
    centers = centers_equal_in_time(20, 2.0)
    widths = widths_by_spacing(centers, 0.7)
    assert np.allclose(np.diag(activations(centers, centers, widths)), 1.0)
    assert np.allclose(np.diag(activations(centers + widths, centers, widths)), np.exp(-0.5))


def test_the_forcing_term_is_linear_in_the_weights(plan):
    fraction = np.linspace(0, 1, 31)
    double = dataclasses.replace(plan, weights=2 * plan.weights)
    assert np.allclose(forcing(double, fraction), 2 * forcing(plan, fraction))


SHARE = np.linspace(0, 1, 40)


@pytest.fixture(scope="module")
def encoding() -> Encoding:
    rng = np.random.default_rng(12)
    swings = []
    for i in range(8):
        duration = 2.0 * np.exp(0.05 * rng.standard_normal())
        t = np.arange(round(100 * duration) + 1) / 100
        size = 1 + 0.1 * rng.standard_normal(3)
        swings.append(Demonstration(f"d{i}", t, size * path(t, duration)))
    return encode(prepare(swings, settings()), settings())


def test_the_covariance_is_that_of_the_demonstrations_parameters(encoding: Encoding) -> None:
    rows = np.array([parameters(encoding.plan(i)) for i in range(len(encoding))])
    assert np.allclose(covariance(encoding.average()), np.cov(rows.T), rtol=1e-9, atol=1e-9)


def test_parameters_go_in_and_out(encoding: Encoding) -> None:
    """Parameters of another swing make it that one; end velocities go as rates, so that it is the path that varies."""
    one, other = encoding.plan(0), encoding.plan(1)
    other = dataclasses.replace(other, start_velocity_m_s=np.arange(3.0), goal_velocity_m_s=np.array([0.4, -1.0, 2.0]))
    made = with_parameters(one, parameters(other))
    for name in ("weights", "duration_s", "goal_m", "start_velocity_m_s", "goal_velocity_m_s"):
        assert getattr(made, name) == pytest.approx(getattr(other, name), rel=1e-12)


def test_drawn_swings_have_the_demonstrations_mean_and_spread(encoding: Encoding) -> None:
    mean = encoding.average()
    rng = np.random.default_rng(0)
    plans = [sample_plan(mean, rng) for _ in range(400)]
    sampled = np.array([play(plan, SHARE * plan.duration_s, steps=200).position_m for plan in plans])
    own = [encoding.plan(i) for i in range(len(encoding))]
    demonstrated = np.array([play(plan, SHARE * plan.duration_s, steps=200).position_m for plan in own])
    spread = demonstrated.std(axis=0, ddof=1)
    # 400 draws: the mean within 4 standard errors, the standard deviation within 4 x 3.5 %
    assert np.abs(sampled.mean(axis=0) - demonstrated.mean(axis=0)).max() < 4 * spread.max() / 20
    assert np.abs(sampled.std(axis=0) - spread).max() < 0.16 * spread.max()
    logs = np.log([plan.duration_s for plan in plans])
    assert np.std(logs) == pytest.approx(np.std([np.log(plan.duration_s) for plan in own], ddof=1), rel=0.16)


def test_the_same_seed_draws_the_same_swing_and_scale_zero_the_mean(encoding: Encoding) -> None:
    mean = encoding.average()
    one, other = (sample_plan(mean, np.random.default_rng(5)) for _ in range(2))
    assert np.array_equal(one.weights, other.weights)
    assert np.allclose(sample_plan(mean, np.random.default_rng(5), 0.0).weights, mean.weights)


def test_one_demonstration_has_no_spread() -> None:
    chosen = settings()
    plan = encode(prepare([demonstration()], chosen), chosen).average()
    assert not covariance(plan).any()
    assert np.allclose(sample_plan(plan, np.random.default_rng(1)).weights, plan.weights)


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
    fraction = np.linspace(0, 1, 17)  # nodes of every grid below
    errors = [error(steps, fraction) for steps in (64, 128, 256, 512)]
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    # a Runge-Kutta solution of order 4 comes to 4 from either side as w h goes from 0.5 to 0.06
    assert np.all(np.abs(orders - 4) < [0.6, 0.35, 0.2])


def test_between_the_nodes_the_solution_is_as_exact_as_on_them():
    fraction = np.random.default_rng(3).uniform(0, 1, 200).clip(0, 1)
    fraction.sort()
    assert error(512, fraction) < 2 * error(512, np.linspace(0, 1, 513))


def test_the_second_derivative_is_the_derivative_of_the_rate():
    solution = solve(drive, np.zeros(2), np.zeros(2), FREQUENCY, 1000)
    fraction = np.linspace(0.01, 0.99, 300)
    h = 1e-5
    slope = (solution.at(fraction + h).rate - solution.at(fraction - h).rate) / (2 * h)
    assert np.abs(slope - solution.at(fraction).second).max() < 1e-5 * np.abs(slope).max()


def test_settling_is_the_solution_without_drive():
    start, rate = np.array([-0.4]), np.array([2.0])
    fraction = np.linspace(0, 1, 50)
    exact = settle(start, rate, FREQUENCY, fraction)
    numeric = solve(lambda s: np.zeros((len(s), 1)), start, rate, FREQUENCY, 2000).at(fraction)
    for name in ("position", "rate", "second"):
        assert np.abs(getattr(exact, name) - getattr(numeric, name)).max() < 1e-7 * np.abs(getattr(exact, name)).max()
