"""Friction of joints from measured torques: two models are fitted, and the better one is chosen.

Coulomb, Stribeck and viscous friction by least squares; a network of two layers per joint, as the paper uses one, by
Levenberg-Marquardt.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from kendama_cli.artifacts.friction_model import FrictionModel, NetworkFriction, ParametricFriction
from kendama_cli.robot_model.friction import direction, network_torque, network_velocity, parametric_torque
from kendama_cli.schema.arrays import Array

Mask = NDArray[np.bool_]

BETTER = 0.99
"""The network must have at most this fraction of the parametric error: with equal errors the plain one stays."""
OUTLIER = 9.0
"""Six standard deviations of a normal distribution, in median errors."""


@dataclass(frozen=True)
class FrictionSamples:
    """Friction torques over velocities, both (k, n), and which of them count, (k, n) of bool."""

    velocity_rad_s: Array
    torque_nm: Array
    kept: Mask


def choose_friction(
    joint_names: Sequence[str],
    train: FrictionSamples,
    held_out: FrictionSamples,
    *,
    hidden: int,
    rng: np.random.Generator,
) -> FrictionModel:
    """Return both models fitted to ``train``; chosen is the one with the smaller rms on ``held_out``, over all
    joints.

    The joints' errors are weighed by the torque that is to be explained, so that a strong joint does not speak alone.
    """
    first = parametric_torque(fit_parametric(train.velocity_rad_s, train.torque_nm, train.kept), train.velocity_rad_s)
    kept = _without_outliers(train.torque_nm - first, train.kept)
    fastest = np.max(np.abs(train.velocity_rad_s) * kept, axis=0)
    parametric = fit_parametric(train.velocity_rad_s, train.torque_nm, kept)
    network = fit_network(train.velocity_rad_s, train.torque_nm, kept, fastest, hidden=hidden, rng=rng)
    plain = _rms(parametric_torque(parametric, held_out.velocity_rad_s) - held_out.torque_nm, held_out.kept)
    of_network = _rms(network_torque(network, held_out.velocity_rad_s, fastest) - held_out.torque_nm, held_out.kept)
    size = np.maximum(_rms(held_out.torque_nm, held_out.kept), 1e-9)
    better = np.sum((of_network / size) ** 2) < BETTER**2 * np.sum((plain / size) ** 2)
    chosen = "network" if better else "parametric"
    return FrictionModel(tuple(joint_names), chosen, parametric, network, fastest, plain, of_network)


def _without_outliers(errors: Array, kept: Mask) -> Mask:
    """Return ``kept`` without samples whose error is above OUTLIER median errors: the ball's impacts, for example."""
    center = np.array([np.median(np.abs(errors[kept[:, j], j])) for j in range(errors.shape[1])])
    return kept & (np.abs(errors) <= OUTLIER * center)


def _rms(errors: Array, kept: Mask) -> Array:
    return np.asarray(np.sqrt((errors**2 * kept).sum(axis=0) / np.maximum(kept.sum(axis=0), 1)))


NARROWEST_RAD_S, WIDEST_RAD_S = 0.02, 1.0
"""Stribeck speeds that are looked for."""
WORTH = 0.02
"""The Stribeck term is kept where it takes more than this share off the squared error: readings err in the same way for
many samples on end, so that an information criterion, which counts them all, would keep it always."""


def fit_parametric(velocity_rad_s: Array, torque_nm: Array, kept: NDArray[np.bool_]) -> ParametricFriction:
    """Fit by least squares ``torque_nm`` (k, n) at ``velocity_rad_s`` (k, n), of the samples ``kept`` (k, n).

    xi is linear in all but vs, which is searched on a grid; where no vs lowers the error by more than WORTH there is no
    Stribeck term. A term may be negative: the controller's settings may hold more friction than there is.
    """
    columns = [
        _fit_joint(velocity_rad_s[kept[:, j], j], torque_nm[kept[:, j], j]) for j in range(velocity_rad_s.shape[1])
    ]
    return ParametricFriction(*np.array(columns).T)


def _fit_joint(velocity_rad_s: Array, torque_nm: Array) -> tuple[float, float, float, float, float]:
    """Fit Fc, Fs, vs, b and o of one joint."""
    plain = np.column_stack([direction(velocity_rad_s), velocity_rad_s, np.ones(len(velocity_rad_s))])
    (coulomb, viscous, offset), minimum = _least_squares(plain, torque_nm)
    best = (coulomb, 0.0, WIDEST_RAD_S, viscous, offset)
    slowest, fastest = np.quantile(np.abs(velocity_rad_s), [0.02, 0.98])
    minimum *= 1 - WORTH
    # a bump narrower than the slowest motion, or nearly as wide as the fastest, is not separable
    for speed in np.geomspace(max(NARROWEST_RAD_S, slowest), max(min(WIDEST_RAD_S, fastest / 4), NARROWEST_RAD_S), 24):
        bump = plain[:, 0] * np.exp(-((velocity_rad_s / speed) ** 2))
        (coulomb, viscous, offset, stribeck), rss = _least_squares(np.column_stack([plain, bump]), torque_nm)
        if rss < minimum:
            best, minimum = (coulomb, stribeck, float(speed), viscous, offset), rss
    return best


def _least_squares(columns: Array, torque_nm: Array) -> tuple[Array, float]:
    # a whiff of regularisation keeps a term that the motion does not show at zero
    scale = 1e-9 * len(columns)
    gram = columns.T @ columns + scale * np.eye(columns.shape[1])
    factors = np.asarray(np.linalg.solve(gram, columns.T @ torque_nm), dtype=np.float64)
    return factors, float(np.sum((columns @ factors - torque_nm) ** 2))


DECAY = 1e-6
"""Weight decay, in fractions of the torque's variance per sample: between the samples the curve stays smooth."""
STARTS = 2
"""Trainings from different random weights; the best remains."""
MOST_STEPS = 60


def fit_network(
    velocity_rad_s: Array,
    torque_nm: Array,
    kept: NDArray[np.bool_],
    max_speed_rad_s: Array,
    *,
    hidden: int,
    rng: np.random.Generator,
) -> NetworkFriction:
    """Train one network of ``hidden`` units per joint on ``torque_nm`` (k, n) of the samples ``kept`` (k, n)."""
    made = [
        _train_joint(
            network_velocity(velocity_rad_s[kept[:, j], j], max_speed_rad_s[j]),
            direction(velocity_rad_s[kept[:, j], j]),
            torque_nm[kept[:, j], j],
            [rng.normal(0.0, 1.0, (hidden, 3)) for _ in range(STARTS)],
        )
        for j in range(velocity_rad_s.shape[1])
    ]
    return NetworkFriction(np.array([one[0] for one in made]), np.array([one[1] for one in made]))


def _train_joint(speed: Array, sign: Array, torque_nm: Array, starts: list[Array]) -> tuple[Array, Array]:
    inputs = np.column_stack([speed, sign, np.ones(len(speed))])
    center, scale = float(torque_nm.mean()), max(float(torque_nm.std()), 1e-9)
    desired = (torque_nm - center) / scale
    h = len(starts[0])
    decay = np.sqrt(DECAY * len(speed))

    def errors(values: Array) -> Array:
        units = np.tanh(inputs @ values[: 3 * h].reshape(h, 3).T)
        return np.concatenate([units @ values[3 * h : -1] + values[-1] - desired, decay * values])

    def slopes(values: Array) -> Array:
        units = np.tanh(inputs @ values[: 3 * h].reshape(h, 3).T)
        through = (1 - units**2) * values[3 * h : -1]
        first = (through[:, :, None] * inputs[:, None, :]).reshape(len(speed), 3 * h)
        return np.vstack([np.hstack([first, units, np.ones((len(speed), 1))]), decay * np.eye(len(values))])

    found = [
        least_squares(
            errors, np.concatenate([start.ravel(), np.zeros(h + 1)]), slopes, method="lm", max_nfev=MOST_STEPS
        )
        for start in starts
    ]
    best = min(found, key=lambda one: float(one.cost)).x
    output = scale * best[3 * h :]
    output[-1] += center
    return best[: 3 * h].reshape(h, 3), output
