"""Fit both models of friction and choose the better one."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from kendama_cli.artifacts.friction_model import FrictionModel
from kendama_cli.identification.friction_network import fit_network
from kendama_cli.identification.friction_parametric import fit_parametric
from kendama_cli.robot_model.friction import network_torque, parametric_torque
from kendama_cli.schema.arrays import Array

Mask = NDArray[np.bool_]

BETTER = 0.99
"""The network must have this share of the parametric model's error, or less: with equal errors the plain one stays."""
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
    """Both models fitted to ``train``; chosen is the one with the smaller rms on ``held_out``, over all joints.

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
    """``kept`` without what is farther off than OUTLIER median errors: the ball's blows, say."""
    middle = np.array([np.median(np.abs(errors[kept[:, j], j])) for j in range(errors.shape[1])])
    return kept & (np.abs(errors) <= OUTLIER * middle)


def _rms(errors: Array, kept: Mask) -> Array:
    return np.asarray(np.sqrt((errors**2 * kept).sum(axis=0) / np.maximum(kept.sum(axis=0), 1)))
