import dataclasses
import itertools

import numpy as np
import pytest

from kendama_cli.artifacts.demonstration import Demonstration
from kendama_cli.motion.averaging import deviation, encode_swing, prepare
from kendama_cli.motion.dmp import play
from tests.motion.swings import demonstration, path, settings


def reproduce(made, chosen):
    swing = prepare(made, chosen)
    return deviation(encode_swing(swing, chosen), swing)


@pytest.mark.parametrize(
    ("changes", "bound_mm"),
    # measured on this swing: 0.26, 0.34, 1.2, 20 mm; the order is the point, the bounds leave 30 %
    [
        ({"regression": "position"}, 0.35),
        ({"regression": "ridge", "ridge": 1e-6}, 0.45),
        ({"regression": "lwr", "width": 0.65, "passes": 100}, 1.6),
        ({"regression": "lwr", "width": 0.65}, 27.0),
    ],
)
def test_each_regression_reproduces_a_swing_within_its_known_error(changes, bound_mm):
    assert 1e3 * reproduce(demonstration(), settings(**changes)).rms_m < bound_mm


def test_position_is_the_nearest_of_the_three():
    rms = {
        name: reproduce(demonstration(), settings(regression=name, ridge=1e-8)).rms_m
        for name in ("position", "ridge", "lwr")
    }
    assert rms["position"] < rms["ridge"] < rms["lwr"]


def test_more_passes_of_lwr_come_closer():
    errors = [
        reproduce(demonstration(), settings(regression="lwr", width=0.65, passes=passes)).rms_m
        for passes in (1, 3, 10, 30, 100)
    ]
    assert all(later < earlier for earlier, later in itertools.pairwise(errors))


@pytest.mark.parametrize("regression", ["position", "ridge"])
def test_a_primitives_own_motion_gives_its_weights_back(regression):
    """The motion of known weights, sampled finely, encodes into a primitive with the same motion."""
    chosen = settings(regression=regression, ridge=1e-12, smoothing_s=0.005, trim="none")
    known = encode_swing(prepare(demonstration(rate_hz=1000), chosen), chosen)
    t_s = np.arange(0, known.duration_s + 1e-9, 1e-3)
    again = Demonstration("again", t_s, play(known, t_s).position_m)
    assert reproduce(again, chosen).max_m < 5e-5


def test_a_swing_cut_while_it_moves_starts_with_its_own_velocity():
    t = np.arange(0.6, 1.4, 0.01)
    cut = Demonstration("cut", t, path(t))
    plan = encode_swing(prepare(cut, settings()), settings())
    truth = (path(np.array([0.6001])) - path(np.array([0.5999])))[0] / 2e-4
    assert np.abs(plan.start_velocity_m_s - truth).max() < 0.01
    assert reproduce(cut, settings()).max_m < 3e-4


def test_a_start_at_rest_is_exactly_at_rest():
    assert not encode_swing(prepare(demonstration(head_s=0.3), settings()), settings()).start_velocity_m_s.any()


def test_noise_of_half_a_millimetre_is_smoothed_not_followed():
    """Against the clean swing: the noise alone would be 0.87 mm in three coordinates.

    20 weights from 200 samples leave a third of it; the start, taken from seven samples, adds an offset to the rest.
    Without any smoothing the offset alone would be 0.87 mm: together 0.91.
    """
    rng = np.random.default_rng(5)
    chosen = settings(trim="none")
    clean = demonstration()
    errors = []
    for _ in range(20):
        noisy = Demonstration("noisy", clean.t_s, clean.position_m + rng.normal(0, 5e-4, clean.position_m.shape))
        swing = prepare(noisy, chosen)
        truth = dataclasses.replace(swing, position_m=clean.position_m - clean.position_m[0])
        errors.append(deviation(encode_swing(swing, chosen), truth).rms_m)
    assert np.median(errors) < 9.1e-4


def test_uneven_sampling_gives_the_same_primitive():
    t = np.linspace(0, 2.0, 201)
    jittered = t + np.random.default_rng(2).uniform(-3e-3, 3e-3, t.shape) * np.sin(np.pi * t / 2)
    even = encode_swing(prepare(demonstration(), settings(trim="none")), settings())
    uneven = encode_swing(prepare(Demonstration("jitter", jittered, path(jittered)), settings(trim="none")), settings())
    share = np.linspace(0, 2.0, 100)
    assert np.abs(play(even, share).position_m - play(uneven, share).position_m).max() < 2e-4


@pytest.mark.recording
def test_the_recorded_swing_is_reproduced_to_a_fraction_of_a_millimetre(recordings):
    rows = np.loadtxt(recordings / "li-kendama" / "kendama1-20.txt")[:350]
    swing = Demonstration(
        "iiwa", np.arange(350) / 100, np.column_stack((-rows[:, 1], 0 * rows[:, 1], rows[:, 3])) / 1e3
    )
    made = reproduce(swing, settings())
    assert made.rms_m < 0.25e-3
    assert made.max_m < 0.65e-3
