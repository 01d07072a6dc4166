"""Friction of an arm's joints: the models that are fitted, and an arm with the one that was identified."""

from __future__ import annotations

import dataclasses

import numpy as np

from kendama_cli.artifacts.friction_model import FrictionModel, NetworkFriction, Numbers, ParametricFriction
from kendama_cli.schema.arrays import Array
from kendama_cli.settings.robot import RobotSettings

SIGN_RAD_S = 0.005
"""The sign of a velocity turns over about this speed: narrow, for the velocities are a reference's, without noise."""
SLOW_RAD_S = 0.05
"""Below this speed the network sees velocities as they are, above it by their logarithms: slow motion shows more."""


def direction(velocity_rad_s: Numbers) -> Numbers:
    """Return the smooth sign tanh(v / SIGN_RAD_S) of a velocity, a number or an array."""
    sign: Numbers = np.tanh(velocity_rad_s * (1.0 / SIGN_RAD_S))
    return sign


def parametric_torque(friction: ParametricFriction, velocity_rad_s: Array) -> Array:
    """Return the torque [Nm] at ``velocity_rad_s`` (..., n) of n joints, its sign smooth about standstill."""
    return friction.torque_nm(velocity_rad_s, direction(velocity_rad_s))


def network_torque(network: NetworkFriction, velocity_rad_s: Array, max_speed_rad_s: Array) -> Array:
    """Return the torque [Nm] at ``velocity_rad_s`` (..., n) of n joints, beyond ``max_speed_rad_s`` (n,) as there.

    xi = W2 tanh(W1 [u(v), sign v, 1]) + b2, with a smooth sign and u = asinh(v / SLOW_RAD_S), scaled to +-1.
    """
    speed = network_velocity(velocity_rad_s, max_speed_rad_s)
    weights = network.hidden
    inner = speed[..., None] * weights[..., 0] + direction(velocity_rad_s)[..., None] * weights[..., 1]
    return np.asarray((np.tanh(inner + weights[..., 2]) * network.output[:, :-1]).sum(axis=-1) + network.output[:, -1])


def network_velocity(velocity_rad_s: Array, max_speed_rad_s: Array) -> Array:
    """Return the velocity as the network reads it: its logarithm where it is not slow, scaled to +-1."""
    fraction = np.arcsinh(velocity_rad_s / SLOW_RAD_S) / np.arcsinh(max_speed_rad_s / SLOW_RAD_S)
    return np.asarray(np.clip(fraction, -1.0, 1.0))


def friction_torque(model: FrictionModel, velocity_rad_s: Array) -> Array:
    """Return the torque [Nm] of the chosen model at ``velocity_rad_s`` (..., n)."""
    if model.chosen == "network":
        return network_torque(model.network, velocity_rad_s, model.max_speed_rad_s)
    return parametric_torque(model.parametric, velocity_rad_s)


def with_identified(robot: RobotSettings, friction: FrictionModel | None) -> RobotSettings:
    """Return ``robot`` with the identified friction in its joints and its controller; unchanged without one.

    The parametric model serves, also where the network is better: simulated joints have Coulomb, Stribeck and viscous
    friction. No term becomes negative; where both have a Stribeck term, the stronger one's speed holds for the sum.
    """
    if friction is None:
        return robot
    found = friction.parametric
    nothing = np.zeros(len(friction.joint_names))
    known = nothing if robot.stribeck_nm is None else np.array(robot.stribeck_nm)
    speed = found.stribeck_rad_s
    if robot.stribeck_rad_s is not None:
        speed = np.where(np.abs(found.stribeck_nm) > known, speed, robot.stribeck_rad_s)

    def together(given: tuple[float, ...] | None, more: np.ndarray) -> tuple[float, ...]:
        total = np.maximum((nothing if given is None else np.array(given)) + more, 0.0)
        return tuple(total.tolist())

    return dataclasses.replace(
        robot,
        coulomb_nm=together(robot.coulomb_nm, found.coulomb_nm),
        viscous_nm_s=together(robot.viscous_nm_s, found.viscous_nm_s),
        stribeck_nm=together(robot.stribeck_nm, found.stribeck_nm),
        stribeck_rad_s=tuple(speed.tolist()),
    )
