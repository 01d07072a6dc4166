"""A two-layer network per joint for its friction, as the paper uses one, trained by Levenberg-Marquardt."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from kendama_cli.artifacts.friction_model import NetworkFriction
from kendama_cli.robot_model.friction import direction, network_velocity
from kendama_cli.schema.arrays import Array

DECAY = 1e-6
"""Weight decay, in shares of the torque's variance per sample: between the samples the curve stays smooth."""
STARTS = 2
"""Trainings from different random weights; the best remains."""
MOST_STEPS = 60


def fit_network(
    velocity_rad_s: Array,
    torque_nm: Array,
    kept: NDArray[np.bool_],
    fastest_rad_s: Array,
    *,
    hidden: int,
    rng: np.random.Generator,
) -> NetworkFriction:
    """Train one network of ``hidden`` units per joint on ``torque_nm`` (k, n) of the samples ``kept`` (k, n)."""
    made = [
        _fit_joint(
            network_velocity(velocity_rad_s[kept[:, j], j], fastest_rad_s[j]),
            direction(velocity_rad_s[kept[:, j], j]),
            torque_nm[kept[:, j], j],
            [rng.normal(0.0, 1.0, (hidden, 3)) for _ in range(STARTS)],
        )
        for j in range(velocity_rad_s.shape[1])
    ]
    return NetworkFriction(np.array([one[0] for one in made]), np.array([one[1] for one in made]))


def _fit_joint(speed: Array, sign: Array, torque_nm: Array, starts: list[Array]) -> tuple[Array, Array]:
    inputs = np.column_stack([speed, sign, np.ones(len(speed))])
    middle, scale = float(torque_nm.mean()), max(float(torque_nm.std()), 1e-9)
    wanted = (torque_nm - middle) / scale
    h = len(starts[0])
    decay = np.sqrt(DECAY * len(speed))

    def errors(values: Array) -> Array:
        units = np.tanh(inputs @ values[: 3 * h].reshape(h, 3).T)
        return np.concatenate([units @ values[3 * h : -1] + values[-1] - wanted, decay * values])

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
    output[-1] += middle
    return best[: 3 * h].reshape(h, 3), output
