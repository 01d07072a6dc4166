"""Strapdown integration against integrators of others, on noiseless data."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicSpline
from scipy.spatial.transform import Rotation

from kendama_cli.plugins.phone.strapdown import integrated, sampled

END_S = 3.0
REST_S = 0.5


def smooth(t_s):
    """Rise from 0 at the rest's end, as smooth as a window of the ninth degree, so that rest and motion join."""
    u = np.clip((np.asarray(t_s) - REST_S) / (END_S - REST_S), 0, 1)
    return u**5 * (1 - u) ** 5 * 1024


def rate_of(t_s):
    t_s = np.asarray(t_s)
    return smooth(t_s)[..., None] * np.stack([3 * np.cos(4 * t_s), 2 * np.sin(3 * t_s), 1.5 + 0 * t_s], axis=-1)


def push_of(t_s):
    t_s = np.asarray(t_s)
    return smooth(t_s)[..., None] * np.stack([8 * np.sin(5 * t_s), 3 * np.cos(2 * t_s), 6 * np.sin(4 * t_s)], axis=-1)


HELD = Rotation.from_euler("xyz", [40, -70, 20], degrees=True)
GRAVITY = 9.80665


def force_of(t_s):
    """Specific force in the body's axes, chosen freely: gravity as held at the start, and a push."""
    return HELD.inv().apply([0, 0, GRAVITY]) + push_of(t_s)


def ours(rate_hz):
    t_s = np.arange(round(END_S * rate_hz) + 1) / rate_hz
    samples = sampled(t_s, CubicSpline(t_s, force_of(t_s)), CubicSpline(t_s, rate_of(t_s)))
    rest = slice(0, round(0.4 * rate_hz))
    values = samples.step_s, samples.force_m_s2[None], samples.rate_rad_s[None]
    return t_s, integrated(values, rest, GRAVITY, np.zeros((1, 3)))


@pytest.mark.parametrize("rate_hz", [200, 400])
def test_a_free_motion_is_integrated_as_by_a_solver_of_differential_equations(rate_hz):
    def slope(t_s, y):
        rotation = Rotation.from_quat(y[:4])
        x, z = y[:3], rate_of(t_s)
        turned = np.concatenate([(y[3] * z + np.cross(x, z)) / 2, [-(x @ z) / 2]])  # q' = q w / 2, scalar last
        return np.concatenate([turned, rotation.apply(force_of(t_s)) - [0, 0, GRAVITY], y[4:7]])

    t_s, track = ours(rate_hz)
    start = Rotation.align_vectors([[0, 0, 1]], [force_of(0.0) / GRAVITY])[0]
    begun = np.concatenate([start.as_quat(), np.zeros(6)])
    solved = solve_ivp(slope, (0, END_S), begun, method="DOP853", t_eval=t_s, rtol=1e-11, atol=1e-12, max_step=0.01)
    heading = Rotation.from_quat(track.rotation_wxyz[0, 0], scalar_first=True) * start.inv()
    assert np.abs(heading.as_rotvec()[:2]).max() < 1e-9  # the two may differ about the vertical alone
    assert track.position_m[0] == pytest.approx(heading.apply(solved.y[7:].T), abs=1e-6)
    assert np.linalg.norm(solved.y[7:, -1]) > 0.5


def test_attitude_is_that_of_the_package_ahrs():
    filters = pytest.importorskip("ahrs.filters", reason="the package ahrs is not installed")
    rate_hz = 1000
    t_s, track = ours(rate_hz)
    middle = rate_of(t_s[:-1] + 0.5 / rate_hz)
    start = track.rotation_wxyz[0, 0]
    rates = np.vstack([middle[:1], middle])
    theirs = filters.AngularRate(gyr=rates, q0=start, frequency=float(rate_hz), method="closed").Q
    apart = Rotation.from_quat(theirs, scalar_first=True).inv() * Rotation.from_quat(
        track.rotation_wxyz[0], scalar_first=True
    )
    assert np.abs(apart.as_rotvec()).max() < 2e-6


def test_a_free_motion_is_integrated_as_by_the_package_scikit_kinematics():
    """Its rule is of the second order (70 um off at 400 Hz): two step lengths extrapolate to none."""
    imus = pytest.importorskip("skinematics.imus", reason="the package scikit-kinematics is not installed")

    def theirs(rate_hz):
        t_s = np.arange(round(END_S * rate_hz) + 1) / rate_hz
        return imus.analytical(np.eye(3), rate_of(t_s), np.zeros(3), force_of(t_s), rate_hz)[1][:: rate_hz // 400]

    coarse, fine, (_, track) = theirs(400), theirs(1600), ours(400)
    apart = [np.abs(one - track.position_m[0]).max() for one in (coarse, fine)]
    assert apart[0] / apart[1] == pytest.approx(16, rel=0.01)  # all that is apart is their rule's own error
    assert fine + (fine - coarse) / 15 == pytest.approx(track.position_m[0], abs=1e-6)
