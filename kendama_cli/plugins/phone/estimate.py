"""Motion from one rest to the next, with the sensors' own errors estimated from both rests.

Maximum a posteriori: the errors e of the sensors (26: biases, scales and cross-axis parts of accelerometer and
gyroscope, and the vertical at the start) minimise |e / sigma_e|^2 + |r(e) / sigma_r|^2. The residuals r are what a hand
at rest cannot have: velocity at the end, and a specific force other than g upwards in both rests. Gauss-Newton; the
inverse of its matrix is the covariance of e (S. Kay, Fundamentals of statistical signal processing, 1993, 11.5). Its
image in the path is the expected error, enlarged where r was larger than the assumed errors make it (the normalised
innovation: Y. Bar-Shalom et al., Estimation with applications to tracking and navigation, 2001, 5.4).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from kendama_cli.motion.rotation import inverse, logarithm, multiply
from kendama_cli.plugins.phone.rests import USED_S, Rest
from kendama_cli.plugins.phone.strapdown import InertialSamples, Track, integrated
from kendama_cli.schema.arrays import Array

GRAVITY_M_S2 = 9.81
BIAS_RAD_S = 0.002
SIGMA = np.concatenate([np.full(3, 0.08), np.full(9, 0.004), np.full(9, 0.006), np.full(3, BIAS_RAD_S), [0.003, 0.003]])
"""Assumed errors of a phone: accelerometer's bias [m/s^2], scale and cross-axis; gyroscope's, and the bias that is left
[rad/s]; the vertical about x and y [rad], by a hand that trembles at rest."""
COUNT, STEPS = len(SIGMA), 0.05 * SIGMA
VELOCITY_M_S, FORCE_M_S2 = 0.01, 0.02
"""A hand at rest moves by so little, and gravity varies by so much between places on Earth."""
TREMOR_S = 0.1
"""A trembling hand turns by so much times its rate, which a mean over the rest takes for a bias."""
PASSES = 4
USUAL_INNOVATION = 2.1
"""Chi-square of six over six stays below in 95 % of the cases."""
LIKELY_FRACTION, LEAST_VELOCITY_M_S = 0.12, 0.05
"""Path errors of recordings of others are about 0.12 v T, with at least that v (median of 559 windows)."""


@dataclass(frozen=True)
class Evidence:
    """Signs of a reconstruction's quality in the recording itself, before anything was corrected."""

    duration_s: float
    rests_s: tuple[float, float]
    velocity_left_m_s: float
    tilt_left_deg: float
    force_change_m_s2: float
    rate_change_deg_s: float
    turn_deg: float
    expected_m: float
    """root mean square error of the path by the assumed errors of the sensors"""
    likely_m: float
    """the same by the velocity left, as in recordings of others"""
    lean_error_deg: float


@dataclass(frozen=True)
class Motion:
    """Path (n, 3) from the first rest and rotation (n, 4) from body to room, of samples ``first`` to ``last``.

    The hand moves from sample ``start`` to ``end``.
    """

    first: int
    last: int
    start: int
    end: int
    position_m: Array
    rotation_wxyz: Array
    evidence: Evidence


@dataclass(frozen=True)
class _Stretch:
    """Samples from the first rest's used part to the second's; the hand moves from ``start`` to ``end``."""

    step_s: float
    force_m_s2: Array
    rate_rad_s: Array
    start: int
    end: int

    @property
    def rests(self) -> tuple[slice, slice]:
        """Samples of both rests."""
        return slice(0, self.start + 1), slice(self.end, (len(self.force_m_s2) + 1) // 2)

    def tracks(self, errors: Array) -> Track:
        """Integrate with the errors (k, 26) taken out: f = (f_m - b)(1 - M)^T, and so the rates."""
        forces = self.force_m_s2 - errors[:, None, :3]
        force = np.einsum("kij,knj->kni", np.eye(3) - errors[:, 3:12].reshape(-1, 3, 3), forces)
        rates = self.rate_rad_s - errors[:, None, None, 21:24]
        rate = np.einsum("kij,kgnj->kgni", np.eye(3) - errors[:, 12:21].reshape(-1, 3, 3), rates)
        lean = np.column_stack([errors[:, 24:], np.zeros(len(errors))])
        return integrated((self.step_s, force, rate), self.rests[0], GRAVITY_M_S2, lean)

    def residuals(self, track: Track) -> Array:
        """Return what no hand at rest has (k, 7), in units of its sigma."""
        forces = [track.force_m_s2[:, one].mean(axis=1) - [0.0, 0.0, GRAVITY_M_S2] for one in self.rests]
        left = track.velocity_m_s[:, self.end] - track.velocity_m_s[:, self.start]
        return np.hstack([left / VELOCITY_M_S, forces[0][:, 2:] / FORCE_M_S2, forces[1] / FORCE_M_S2])

    def most_probable(self) -> tuple[Array, Array, float]:
        """Return the errors (26,), a root of their covariance (26, 26), and how far they exceed the assumed ones."""
        estimate, excess, matrix = np.zeros(COUNT), 1.0, np.eye(COUNT)
        for number in range(PASSES):
            values = self.residuals(self.tracks(np.vstack([estimate, estimate + np.diag(STEPS)])))
            slopes = (values[1:] - values[0]).T / STEPS
            if number == 0:
                predicted = (slopes * SIGMA**2) @ slopes.T + np.eye(len(values[0]))
                innovation = float(values[0] @ np.linalg.solve(predicted, values[0])) / len(values[0])
                excess = max(innovation / USUAL_INNOVATION, 1.0)
            matrix = slopes.T @ slopes + np.diag(SIGMA**-2)
            estimate = estimate - np.linalg.solve(matrix, slopes.T @ values[0] + estimate / SIGMA**2)
        # larger errors than assumed are not explained by them: what is left is spread
        return estimate / excess, np.linalg.cholesky(np.linalg.inv(matrix)), excess


def motion_between(samples: InertialSamples, before: Rest, after: Rest) -> Motion:
    """Reconstruct the motion between two rests, from the used part of the first to that of the second."""
    step_s = samples.step_s
    used = max(2, round(USED_S / step_s))
    first, last = max(before.first, before.last - used), min(after.last, after.first + used)
    part = slice(2 * first, 2 * last + 1)
    force, rate = samples.force_m_s2[part], samples.rate_rad_s[:, part.start : part.stop - 1]
    start, end = before.last - first, after.first - first
    rests = (slice(0, start + 1), slice(end, last - first + 1))
    rates = [rate[:, 2 * one.start : 2 * one.stop - 2].mean(axis=(0, 1)) for one in rests]
    spreads = [float(rate[:, 2 * one.start : 2 * one.stop - 2].std(axis=1).max()) for one in rests]
    lengths_s = [(one.stop - one.start) * step_s for one in rests]
    sigmas = [TREMOR_S * spread / length_s + BIAS_RAD_S for spread, length_s in zip(spreads, lengths_s, strict=True)]
    rate = rate - np.average(rates, axis=0, weights=np.array(sigmas) ** -2.0)
    stretch = _Stretch(step_s, force, rate, start, end)

    plain = stretch.tracks(np.zeros((1, COUNT)))
    estimate, root, excess = stretch.most_probable()
    track = stretch.tracks(np.vstack([estimate, estimate + np.diag(STEPS)]))
    paths = _at_rest(track, start, end, step_s)
    spread = root / STEPS[:, None]
    moved = np.einsum("knd,kj->jnd", paths[1:] - paths[0], spread)[:, start : end + 1]
    moved -= moved.mean(axis=1, keepdims=True)
    turns = logarithm(multiply(track.rotation_wxyz[1:], inverse(track.rotation_wxyz[:1])))
    leant = np.einsum("knd,kj->jnd", turns, spread)[:, start : end + 1, :2]
    duration_s = (end - start) * step_s
    velocity_left = float(np.linalg.norm(plain.velocity_m_s[0, end] - plain.velocity_m_s[0, start]))
    forces = [plain.force_m_s2[0, one].mean(axis=0) for one in rests]
    likely_m = LIKELY_FRACTION * max(velocity_left, LEAST_VELOCITY_M_S) * duration_s
    posterior_m = float(np.sqrt((moved**2).sum(axis=(0, 2)).mean() * excess))
    rotation = track.rotation_wxyz[0]
    turned = np.linalg.norm(logarithm(multiply(rotation, inverse(rotation[start]))), axis=1)
    evidence = Evidence(
        duration_s=duration_s,
        rests_s=((before.last - before.first) * step_s, (after.last - after.first) * step_s),
        velocity_left_m_s=velocity_left,
        tilt_left_deg=float(np.degrees(np.arctan2(np.hypot(*forces[1][:2]), forces[1][2]))),
        force_change_m_s2=abs(float(np.linalg.norm(forces[1]) - np.linalg.norm(forces[0]))),
        rate_change_deg_s=float(np.degrees(np.linalg.norm(rates[1] - rates[0]))),
        turn_deg=float(np.degrees(turned[start : end + 1].max())),
        expected_m=posterior_m,
        likely_m=max(likely_m, posterior_m),
        lean_error_deg=float(np.degrees(np.sqrt((leant**2).sum(axis=(0, 2)).mean()))),
    )
    return Motion(first, last, before.last, after.first, paths[0], rotation, evidence)


def _at_rest(track: Track, start: int, end: int, step_s: float) -> Array:
    """Return paths (k, n, 3) that rest up to ``start`` and from ``end`` on; what velocity is left grows linearly."""
    count = np.clip(np.arange(track.position_m.shape[1]) - start, 0, end - start)
    t_s = (count * step_s)[None, :, None]
    path = track.position_m[:, start + count] - track.position_m[:, start : start + 1]
    began = track.velocity_m_s[:, start : start + 1]
    left = track.velocity_m_s[:, end : end + 1] - began
    return np.asarray(path - began * t_s - left * t_s**2 / (2 * (end - start) * step_s))
