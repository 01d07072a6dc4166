import itertools

import numpy as np
import pytest
from scipy.interpolate import CubicSpline
from scipy.signal import savgol_filter

from kendama_cli.artifacts.demonstration import Demonstration
from kendama_cli.motion.dmp import encoding
from kendama_cli.motion.dmp.averaging import encode, encode_demonstrations, prepare
from kendama_cli.motion.dmp.basis import Basis
from kendama_cli.motion.dmp.onset import TrimmedDemonstration
from kendama_cli.motion.dmp.primitive import forcing, play
from tests.motion.swings import demonstration, path, settings


def reproduce(made, chosen):
    encoding = encode(prepare([made], chosen), chosen)
    return encoding.deviation(encoding.plan(0), 0)


@pytest.mark.parametrize(
    ("changes", "bound_mm"),
    # measured on this swing: 0.03, 1.0, 18 mm; the order is the point
    [
        ({"regression": "position"}, 0.06),
        ({"regression": "lwr", "width": (0.65,), "passes": 100}, 1.6),
        ({"regression": "lwr", "width": (0.65,)}, 27.0),
    ],
)
def test_each_regression_reproduces_a_swing_within_its_known_error(changes, bound_mm):
    assert 1e3 * reproduce(demonstration(), settings(**changes)).rms_m < bound_mm


@pytest.mark.parametrize("count", [301, 1500])
def test_a_swing_is_thinned_by_cubics(count):
    """A cubic comes back as it is at even fractions of its length."""
    first, weights = encoding._cubic_weights(count)
    cubic = np.polynomial.Polynomial([1.0, -2.0, 0.5, 3.0], [0, count - 1])
    seen, wanted = cubic(np.arange(count)), cubic(np.linspace(0, count - 1, len(first)))
    assert (weights * seen[first]).sum(axis=1) == pytest.approx(wanted, abs=1e-9)
    off = np.abs(first.mean(axis=1) - np.linspace(0, count - 1, len(first)))
    assert off[1:-1].max() < 1.0, "by the four samples about it"
    assert off.max() <= 1.5


def test_more_passes_of_lwr_come_closer():
    errors = [
        reproduce(demonstration(), settings(regression="lwr", width=(0.65,), passes=passes)).rms_m
        for passes in (1, 3, 10, 30, 100)
    ]
    assert all(later < earlier for earlier, later in itertools.pairwise(errors))


def test_a_primitives_own_motion_gives_its_weights_back():
    """The motion of known weights, sampled finely, encodes into a primitive with the same motion."""
    chosen = settings(trim="none", width=(1.0,))
    known = encode_demonstrations([demonstration(rate_hz=1000)], chosen)
    t_s = np.arange(0, known.duration_s + 1e-9, 1e-3)
    again = Demonstration("again", t_s, play(known, t_s).position_m)
    assert reproduce(again, chosen).max_m < 5e-5


@pytest.mark.parametrize("regression", ["position", "lwr"])
def test_a_swing_cut_while_it_moves_keeps_the_velocities_of_its_ends(regression):
    t = np.arange(0.6, 1.4, 0.01)
    chosen = settings(regression=regression)
    made = encode(prepare([Demonstration("cut", t, path(t))], chosen), chosen)
    assert made.parameters.origin_m == pytest.approx(0.0, abs=1e-3)
    plan = made.average()
    for at, found in ((t[0], plan.start_velocity_m_s), (t[-1], plan.goal_velocity_m_s)):
        truth = (path(np.array([at + 1e-4])) - path(np.array([at - 1e-4])))[0] / 2e-4
        assert np.abs(found - truth).max() < 0.02


@pytest.mark.parametrize("regression", ["position", "lwr"])
def test_a_swing_that_rests_at_its_ends_has_no_velocity_there(regression):
    plan = encode_demonstrations([demonstration(head_s=0.3, tail_s=0.3)], settings(regression=regression))
    assert not plan.start_velocity_m_s.any()
    assert not plan.goal_velocity_m_s.any()


@pytest.mark.parametrize(
    ("samples", "smoothing_s", "window"), [(101, 0.1, 11), (101, 0.01, 5), (101, 0.13, 13), (10, 9.0, 9), (9, 9.0, 9)]
)
@pytest.mark.parametrize("even", [True, False])
def test_derivatives_are_those_of_savitzky_and_golay(samples: int, smoothing_s: float, window: int, even: bool):
    """Scipy's, of local cubics, with those of the first and last window at the ends; uneven samples are made even."""
    rng, duration_s = np.random.default_rng(10013), (samples - 1) / 100
    grid, position = np.linspace(0, 1, samples), rng.normal(size=(samples, 2))
    share = None if even else grid + 0.3 / samples * rng.uniform(-1, 1, samples) * (grid % 1 > 0)
    made = encoding.derivatives(
        TrimmedDemonstration(position, share, duration_s, 0.0, True, True, False, False), smoothing_s
    )
    known = position if share is None else CubicSpline(share, position)(grid)
    assert made.share == pytest.approx(grid)
    for order, found in enumerate((made.position, made.rate, made.second)):
        wanted = savgol_filter(known, window, 3, deriv=order, delta=1 / (samples - 1), axis=0, mode="interp")
        assert found == pytest.approx(wanted, abs=1e-9 * np.abs(wanted).max())


def test_the_force_of_a_primitives_motion_is_its_own():
    """The motion begins and ends moving."""
    t = np.arange(0.5, 1.2, 0.01)
    plan = encode_demonstrations([Demonstration("cut", t, path(t))], settings(width=(1.1,)))
    share = np.linspace(0, 0.99, 34)
    made = play(plan, share * plan.duration_s)
    rate, second = made.velocity_m_s * plan.duration_s, made.acceleration_m_s2 * plan.duration_s**2
    motion = encoding.Derivatives(share, made.position_m, rate, second)
    basis = Basis(len(plan.centers), plan.stiffness, plan.phase_decay, 1.1)
    force = encoding.target_force(motion, plan.goal_m, plan.goal_velocity_m_s * plan.duration_s, basis)
    assert force == pytest.approx(forcing(plan, share), abs=1e-6 * np.abs(force).max())


def test_each_function_is_fitted_by_itself_to_what_the_pass_before_left():
    """w_j = sum_i psi_j x f / sum_i psi_j x^2, number by number."""
    basis, share = Basis(4, 100.0, 1.5, 0.8), np.linspace(0, 1, 13)
    force, weights = np.random.default_rng(10014).normal(size=(13, 2)), np.zeros((4, 2))
    x = np.exp(-1.5 * share)
    for _ in range(3):
        rest = force - basis.features(share) @ weights
        for j, k in np.ndindex(4, 2):
            psi = np.exp(-((x - basis.centers[j]) ** 2) / (2 * basis.widths[j] ** 2))
            weights[j, k] += (psi * x * rest[:, k]).sum() / (psi * x**2).sum()
    assert encoding.locally_weighted(share, force, basis, passes=3) == pytest.approx(weights)


def test_the_best_width_is_taken_for_all_demonstrations_together():
    """The basis that plain weighting fits best is narrow; a wider basis, offered first, is passed over."""
    wide, narrow, both = (
        settings(regression="lwr", width=one, passes=3) for one in ((2.0,), (0.65,), (2.0, 0.65, 1.5))
    )
    assert reproduce(demonstration(), narrow).rms_m < reproduce(demonstration(), wide).rms_m
    assert encode(prepare([demonstration(), demonstration(2.3)], both), both).basis.width == 0.65
