import itertools

import numpy as np
import pytest

from kendama_cli.artifacts.demonstration import Demonstration
from kendama_cli.motion.dmp import encoding
from kendama_cli.motion.dmp.averaging import encode, encode_demonstrations, prepare
from kendama_cli.motion.dmp.primitive import play
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
    plan = encode_demonstrations([Demonstration("cut", t, path(t))], settings(regression=regression))
    for at, found in ((t[0], plan.start_velocity_m_s), (t[-1], plan.goal_velocity_m_s)):
        truth = (path(np.array([at + 1e-4])) - path(np.array([at - 1e-4])))[0] / 2e-4
        assert np.abs(found - truth).max() < 0.02


@pytest.mark.parametrize("regression", ["position", "lwr"])
def test_a_swing_that_rests_at_its_ends_has_no_velocity_there(regression):
    plan = encode_demonstrations([demonstration(head_s=0.3, tail_s=0.3)], settings(regression=regression))
    assert not plan.start_velocity_m_s.any()
    assert not plan.goal_velocity_m_s.any()
