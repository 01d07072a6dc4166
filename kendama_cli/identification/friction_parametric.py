"""Coulomb, Stribeck and viscous friction, fitted to measured torques."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from kendama_cli.artifacts.friction_model import ParametricFriction
from kendama_cli.robot_model.friction import direction
from kendama_cli.schema.arrays import Array

NARROWEST_RAD_S, WIDEST_RAD_S = 0.02, 1.0
"""Stribeck speeds that are looked for."""
WORTH = 0.02
"""The Stribeck term is kept where it takes more than this share off the squared error: readings err in the same way for
many samples on end, so that an information criterion, which counts them all, would keep it always."""


def fit_parametric(velocity_rad_s: Array, torque_nm: Array, kept: NDArray[np.bool_]) -> ParametricFriction:
    """Least squares on ``torque_nm`` (k, n) at ``velocity_rad_s`` (k, n), of the samples ``kept`` (k, n).

    xi is linear in all but vs, which is searched on a grid; where no vs lowers the error by more than WORTH there is no
    Stribeck term. A term may be negative: the controller's settings may hold more friction than there is.
    """
    columns = [
        _fit_joint(velocity_rad_s[kept[:, j], j], torque_nm[kept[:, j], j]) for j in range(velocity_rad_s.shape[1])
    ]
    return ParametricFriction(*np.array(columns).T)


def _fit_joint(velocity_rad_s: Array, torque_nm: Array) -> tuple[float, float, float, float, float]:
    """Fc, Fs, vs, b and o of one joint."""
    plain = np.column_stack([direction(velocity_rad_s), velocity_rad_s, np.ones(len(velocity_rad_s))])
    (coulomb, viscous, offset), least = _least_squares(plain, torque_nm)
    best = (coulomb, 0.0, WIDEST_RAD_S, viscous, offset)
    slowest, fastest = np.quantile(np.abs(velocity_rad_s), [0.02, 0.98])
    least *= 1 - WORTH
    # a bump narrower than the slowest motion, or nearly as wide as the fastest, is not separable
    for speed in np.geomspace(max(NARROWEST_RAD_S, slowest), max(min(WIDEST_RAD_S, fastest / 4), NARROWEST_RAD_S), 24):
        bump = plain[:, 0] * np.exp(-((velocity_rad_s / speed) ** 2))
        (coulomb, viscous, offset, stribeck), rss = _least_squares(np.column_stack([plain, bump]), torque_nm)
        if rss < least:
            best, least = (coulomb, stribeck, float(speed), viscous, offset), rss
    return best


def _least_squares(columns: Array, torque_nm: Array) -> tuple[Array, float]:
    # a whiff of regularisation keeps a term that the motion does not show at zero
    scale = 1e-9 * len(columns)
    gram = columns.T @ columns + scale * np.eye(columns.shape[1])
    factors = np.asarray(np.linalg.solve(gram, columns.T @ torque_nm), dtype=np.float64)
    return factors, float(np.sum((columns @ factors - torque_nm) ** 2))
