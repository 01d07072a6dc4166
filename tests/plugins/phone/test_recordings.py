"""Recordings of others, with what is known of their true path, beside plain double integration.

Bounds are the rest-to-rest figures of the recordings' README.
"""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest
from scipy.interpolate import CubicSpline

from kendama_cli.errors import InputError
from kendama_cli.plugins.phone.files import read_exports
from kendama_cli.plugins.phone.swings import open_phone, reconstructed
from tests.plugins.phone.phones import REAL, plain_path, settings

pytestmark = [
    pytest.mark.recording,
    pytest.mark.skipif(not REAL.is_dir(), reason="needs the real recordings beside the repository"),
]


def files(name):
    return [str(one) for one in sorted((REAL / name).glob("*.csv")) if one.name != "truth.csv"]


def path_of(name):
    chosen = settings(files(name))
    (export,) = read_exports(chosen.path)
    whole = reconstructed(export, chosen)
    signals = whole.signals
    plain = plain_path(signals.t_s, signals.force(signals.t_s), signals.rate(signals.t_s))
    return signals.t_s, whole.recording.position_m, plain


def truth_of(name):
    return pd.read_csv(REAL / name / "truth.csv").to_numpy()[:, :4]


def test_a_phone_pushed_over_a_table_stays_level_and_goes_straight():
    _, path, _ = path_of("slide")
    assert abs(path[-1, 2]) < 0.003
    assert np.hypot(*path[-1, :2]) == pytest.approx(0.68, abs=0.01)


def test_a_phone_pushed_there_and_back_comes_back():
    _, path, plain = path_of("there-and-back")
    assert np.linalg.norm(path[-1]) < 0.022
    assert np.linalg.norm(plain[-1]) > 0.05
    assert np.linalg.norm(path[:, :2], axis=1).max() == pytest.approx(0.69, abs=0.04)


def test_a_robot_lowers_the_sensor_as_far_as_it_says():
    t_s, path, plain = path_of("robot-lift")
    truth = truth_of("robot-lift")
    inside = (truth[:, 0] > t_s[0]) & (truth[:, 0] < t_s[-1])

    def off(one):
        return CubicSpline(t_s, one[:, 2])(truth[inside, 0]) - truth[inside, 3]

    assert np.sqrt(np.mean(off(path) ** 2)) < 0.006
    assert abs(off(path)[-1]) < 0.009
    assert np.linalg.norm((plain - path)[-1]) > 0.05


def test_a_step_of_a_shoe_ends_nearer_than_without_the_rest_at_its_end():
    _, path, plain = path_of("stride")
    level_m, height_m = np.hypot(*truth_of("stride")[-1, 1:3]), truth_of("stride")[-1, 3]
    far, null = (np.hypot(np.hypot(*one[-1, :2]) - level_m, one[-1, 2] - height_m) for one in (path, plain))
    assert far < 0.063
    assert null > far


def test_a_wild_arch_is_told_to_be_poor():
    (hand,) = open_phone(settings(files("arch-in-hand")))
    told = "\n".join(hand.warnings)
    for line in (
        "the path is poor",
        "of tilt left",
        "the motion takes 3.5 s",
        "peaks at 13 rad/s",
        "errors grow with it: lean less",
    ):
        assert line in told


def test_a_recording_that_does_not_end_in_a_rest_is_refused():
    with pytest.raises(InputError, match=r"it ends without a rest .* hold the phone still for a second before and"):
        open_phone(settings(files("hand-from-rest")))
