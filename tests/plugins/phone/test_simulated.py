"""Simulated phones over fresh seeds: medians beside plain double integration, and what is seen of bad recordings."""

from __future__ import annotations

import re

import numpy as np
import pytest
from scipy.interpolate import CubicSpline
from scipy.spatial.transform import Rotation

from kendama_cli.errors import InputError
from kendama_cli.plugins.phone.files import read_exports
from kendama_cli.plugins.phone.swings import open_phone, reconstructed
from tests.plugins.phone.phones import (
    BMI160,
    BMI270,
    Sensors,
    bundled_swing,
    plain_path,
    rms_m,
    settings,
    take,
    write_phyphox,
)


def tried(folder, seed, **how):
    """Return error, error of plain integration, expected error [m], and the hand of a simulated phone."""
    one = take(np.random.default_rng(seed), bundled_swing(1 + seed % 12), **how)
    path = str(write_phyphox(folder / f"{seed}.zip", one.t_s, one.force, one.rate))
    chosen = settings(path)
    whole = reconstructed(read_exports((path,))[0], chosen)
    true = CubicSpline(one.true_s, one.true_m)
    t_s = np.clip(whole.signals.t_s, 0, one.true_s[-1])
    null = plain_path(one.t_s, one.force, one.rate, min(0.8, how.get("rests_s", (1,))[0]))
    expected = max(motion.evidence.expected_m for motion in whole.motions)
    stamps = np.clip(one.t_s, 0, one.true_s[-1])
    return rms_m(whole.recording.position_m, true(t_s)), rms_m(null, true(stamps)), expected


@pytest.mark.parametrize(
    ("how", "bound_m"),
    [
        pytest.param({"lean_deg": 20.0}, 0.010, marks=pytest.mark.slow),
        ({"lean_deg": 45.0}, 0.016),
        ({"rate_hz": 50.0}, 0.012),
        pytest.param({"rate_hz": 500.0}, 0.010, marks=pytest.mark.slow),  # 50 and 100 Hz are here
        ({"rests_s": (0.5, 2.0)}, 0.012),
        ({"lost": 0.02}, 0.012),
        pytest.param({"rate_hz": 200.0}, 0.010, marks=pytest.mark.slow),
        ({"sensors": Sensors(stray_s=0.002)}, 0.012),
        pytest.param({"sensors": BMI270}, 0.010, marks=pytest.mark.slow),
        ({"sensors": BMI160}, 0.010),
    ],
)
def test_a_swing_is_found_again_better_than_by_plain_integration(tmp_path, how, bound_m):
    results = np.array([tried(tmp_path, seed, **how) for seed in range(8)])
    error, null = np.median(results[:, :2], axis=0)
    assert error < bound_m
    assert error < 0.6 * null
    assert np.mean(np.abs(np.log(results[:, 2] / results[:, 0])) < np.log(3)) >= 0.7


def test_without_errors_little_is_left(tmp_path):
    error, null, _ = tried(tmp_path, 3, grade=0.0)
    assert error < 0.003  # the first and last centimetres per second are taken for rest
    assert null < 0.02


def hands(folder, one, **changes):
    return open_phone(settings(str(write_phyphox(folder / "a.zip", one.t_s, one.force, one.rate)), **changes))


def test_the_lean_of_the_hand_goes_into_the_demonstration(tmp_path):
    one = take(np.random.default_rng(1), bundled_swing(), lean_deg=30.0)
    (hand,) = hands(tmp_path, one)
    samples = list(hand.samples())
    made = Rotation.from_quat([sample.rotation_wxyz for sample in samples], scalar_first=True)
    assert samples[0].rotation_wxyz == pytest.approx([1, 0, 0, 0])
    true = one.true_rotation * one.true_rotation[0].inv()
    assert made.magnitude().max() == pytest.approx(true.magnitude().max(), abs=np.radians(1.5))


def test_a_sensor_beside_the_cup_is_moved_to_it(tmp_path):
    one = take(np.random.default_rng(1), bundled_swing(), lean_deg=40.0, grade=0.0)
    offset = [0.0, 0.0, 0.1]
    cup_m = one.true_m.copy()
    turned = one.true_rotation * one.true_rotation[0].inv()
    sensor_m = cup_m + turned.apply(offset)
    t_s = one.true_s
    force = one.true_rotation.inv().apply(CubicSpline(t_s, sensor_m)(t_s, 2) + np.array([0, 0, 9.81]))
    path = str(write_phyphox(tmp_path / "b.zip", t_s, force, one.rate))
    (near,) = open_phone(settings(path, sensor_in_cup_m=offset))
    (far,) = open_phone(settings(path))
    errors = []
    for hand in (near, far):
        samples = list(hand.samples())
        path_m = np.array([sample.position_m for sample in samples])
        at_s = t_s[0] + np.array([sample.t_s for sample in samples])
        errors.append(rms_m(path_m, CubicSpline(t_s, cup_m)(np.minimum(at_s, t_s[-1]))))
    assert errors[0] < 0.004
    assert errors[1] > 2 * errors[0]


def test_two_swings_in_one_recording_are_cut_apart(tmp_path):
    first, second = (take(np.random.default_rng(seed), bundled_swing(seed), rests_s=(1.0, 1.0)) for seed in (1, 1))
    shift_s = first.t_s[-1] + 0.01
    joined = [np.concatenate([getattr(first, key), getattr(second, key)]) for key in ("force", "rate")]
    stamps = np.concatenate([first.t_s, second.t_s + shift_s])
    path = str(write_phyphox(tmp_path / "two.zip", stamps, *joined))
    assert [hand.name for hand in open_phone(settings(path))] == ["two-1", "two-2"]


def test_a_clipped_sensor_is_told(tmp_path):
    one = take(np.random.default_rng(1), bundled_swing(), limit_m_s2=0.85 * 9.81 + 4)
    (hand,) = hands(tmp_path, one)
    assert any("clipped: swing more gently" in line for line in hand.warnings)


def test_the_closing_line_says_what_is_likely_and_what_cannot_be_seen(tmp_path):
    (hand,) = hands(tmp_path, take(np.random.default_rng(1), bundled_swing()))
    (line,) = [one for one in hand.warnings if "inertial sensors" in one]
    assert "mm rms (sensors as assumed)" in line
    assert line.endswith("neither is a bound; scale, heading and mirror of the path cannot be seen in it")


def test_a_short_rest_is_told(tmp_path):
    (hand,) = hands(tmp_path, take(np.random.default_rng(1), bundled_swing(), rests_s=(0.3, 1.0)))
    assert any("s only: hold still for a second" in line for line in hand.warnings)


@pytest.mark.parametrize("rest_s", [0.2, 0.3, 0.8, 2.0])
def test_short_rests_are_told_or_refused_and_long_ones_pass(tmp_path, rest_s):
    one = take(np.random.default_rng(2), bundled_swing(), rests_s=(rest_s, rest_s))
    try:
        said = [line for hand in hands(tmp_path, one) for line in hand.warnings]
    except InputError as refused:
        said = [f"refused: {refused}"]
    about = [line for line in said if re.search(r"^refused: .*hold the phone still|s only: hold still", line)]
    assert bool(about) is (rest_s < 0.5), said


def test_a_gap_amid_the_motion_is_refused(tmp_path):
    one = take(np.random.default_rng(1), bundled_swing())
    kept = (one.t_s < 1.8) | (one.t_s > 1.9)
    path = str(write_phyphox(tmp_path / "a.zip", one.t_s[kept], one.force[kept], one.rate[kept]))
    with pytest.raises(InputError, match=r"accelerometer for 1\d\d ms; allowed: 60; .*max_gap_s"):
        open_phone(settings(path))


def test_a_wrong_gyroscope_is_refused(tmp_path):
    one = take(np.random.default_rng(1), bundled_swing(), lean_deg=45.0)
    path = str(write_phyphox(tmp_path / "a.zip", one.t_s, one.force, one.rate * [1.0, 0.5, 0.7]))
    with pytest.raises(InputError, match=r"hold the phone still for a second before and after"):
        open_phone(settings(path))


def test_a_phone_that_is_never_still_is_refused(tmp_path):
    one = take(np.random.default_rng(1), bundled_swing())
    moving = (one.t_s > 1.2) & (one.t_s < 2.0)
    path = str(write_phyphox(tmp_path / "a.zip", one.t_s[moving], one.force[moving], one.rate[moving]))
    with pytest.raises(InputError, match=r"without a rest|never still"):
        open_phone(settings(path))
