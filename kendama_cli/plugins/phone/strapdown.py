"""Strapdown integration: attitude, velocity and position from rotation rate and specific force in the body's axes.

    q' = q (x) w / 2,    v' = R(q) f - g e_z,    p' = v

(P. G. Savage, Strapdown inertial navigation integration algorithm design, J. Guid. Control Dyn. 21, 1998, parts 1 and
2; O. J. Woodman, An introduction to inertial navigation, Cambridge UCAM-CL-TR-696, 2007, section 6). A rotation vector
a step keeps rotations exact at any lean; Euler angles would not.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline

from kendama_cli.motion.rotation import exponential, multiply, rotated
from kendama_cli.schema.arrays import Array

_GAUSS = 3**0.5 / 6


@dataclass(frozen=True)
class InertialSamples:
    """Even samples at ``t_s`` (n,) and what the integration needs between them.

    ``force_m_s2`` (2 n - 1, 3) stands at the samples and halfway between; ``rate_rad_s`` (2, 2 n - 2, 3) at both Gauss
    points of every half step. Both are of a cubic spline through the samples, which are taken as values at their time.
    """

    t_s: Array
    force_m_s2: Array
    rate_rad_s: Array

    @property
    def step_s(self) -> float:
        """Time between samples [s]."""
        return float(self.t_s[1] - self.t_s[0])


@dataclass(frozen=True)
class Track:
    """Attitude and motion of k variants: ``rotation_wxyz`` (k, n, 4) from body to room, z up; others (k, n, 3)."""

    rotation_wxyz: Array
    force_m_s2: Array
    velocity_m_s: Array
    position_m: Array


def sampled(t_s: Array, force: CubicSpline, rate: CubicSpline) -> InertialSamples:
    """Return the samples of both splines at even times (n,)."""
    half_s = (t_s[1] - t_s[0]) / 2
    fine_s = np.linspace(t_s[0], t_s[-1], 2 * len(t_s) - 1)
    middle_s = fine_s[:-1] + half_s / 2
    offset_s = _GAUSS * half_s
    return InertialSamples(t_s, force(fine_s), np.stack([rate(middle_s - offset_s), rate(middle_s + offset_s)]))


def integrated(samples: tuple[float, Array, Array], rest: slice, gravity_m_s2: float, lean_rad: Array) -> Track:
    """Integrate k variants from rest: of ``samples`` the step [s], forces (k, 2 n - 1, 3), rates (k, 2, 2 n - 2, 3).

    A half step turns by the rotation vector of Bortz's equation to fourth order, h (w1 + w2) / 2 + sqrt(3) h^2 (w1 x
    w2) / 12 with w at the Gauss points (S. Blanes et al., Phys. Rep. 470, 2009, section 5.4; the second term is the
    coning correction). Velocity and position follow by Simpson's rule over a step. The vertical is the mean force over
    the samples of ``rest``, carried there by the rotation, so that a hand that leans while it rests does no harm, and
    turned by ``lean_rad`` (k, 3).
    """
    step_s, force, rate = samples
    half_s = step_s / 2
    first, second = rate[:, 0], rate[:, 1]
    turned = exponential(half_s / 2 * (first + second) + 3**0.5 / 12 * half_s**2 * np.cross(first, second))
    rotation = np.concatenate([np.broadcast_to([1.0, 0, 0, 0], (len(rate), 1, 4)), turned], axis=1)
    span = 1
    while span < rotation.shape[1]:  # all products from the start on, in log2(n) passes
        rotation[:, span:] = multiply(rotation[:, :-span], rotation[:, span:])
        span *= 2
    rotation /= np.linalg.norm(rotation, axis=-1, keepdims=True)
    level = _applied(rotation, force)
    upright = _upright(level[:, ::2][:, rest].mean(axis=1))
    rotation = multiply(multiply(exponential(lean_rad), upright)[:, None], rotation)
    level = _applied(rotation, force)
    acceleration = level - [0.0, 0.0, gravity_m_s2]
    before, middle, after = acceleration[:, :-1:2], acceleration[:, 1::2], acceleration[:, 2::2]
    velocity = _summed(step_s / 6 * (before + 4 * middle + after))
    position = _summed(step_s * velocity[:, :-1] + step_s**2 / 6 * (before + 2 * middle))
    return Track(rotation[:, ::2], level[:, ::2], velocity, position)


def _applied(rotation: Array, vector: Array) -> Array:
    return rotated(rotation.reshape(-1, 4), vector.reshape(-1, 3)).reshape(vector.shape)


def _upright(up: Array) -> Array:
    """Return the shortest rotations (k, 4) that bring ``up`` (k, 3) to z."""
    unit = up / np.linalg.norm(up, axis=1, keepdims=True)
    half = np.column_stack([1 + unit[:, 2], unit[:, 1], -unit[:, 0], np.zeros(len(unit))])
    opposite = half[:, 0] < 1e-9
    half[opposite] = [0.0, 1.0, 0.0, 0.0]
    return np.asarray(half / np.linalg.norm(half, axis=1, keepdims=True))


def _summed(steps: Array) -> Array:
    return np.concatenate([np.zeros_like(steps[:, :1]), np.cumsum(steps, axis=1)], axis=1)
