"""A chain of random links, and its dynamics by Lagrange's equations: a referee for compiled chains."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from kendama_cli.robot_model.chain_kernel import Chain
from kendama_cli.schema.arrays import Array

GRAVITY = 9.7


def random_chain(rng: np.random.Generator, joints: int = 4) -> Chain:
    """Return a chain whose links have any axis, place and inertia, with friction and rotors."""
    axes = rng.normal(size=(joints, 3))
    square = rng.normal(size=(joints, 3, 3))
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    return Chain(
        axes / np.linalg.norm(axes, axis=1)[:, None],
        rng.normal(0, 0.4, (joints, 3)),
        rng.normal(0, 0.4, 3),
        turn * np.linalg.det(turn),
        rng.uniform(0.5, 3, joints),
        rng.normal(0, 0.4, (joints, 3)),
        square @ square.transpose(0, 2, 1) / 10,
        *rng.uniform(0.1, 2, (5, joints)),
        GRAVITY,
    )


def poses(chain: Chain, angles: Array) -> list[tuple[Array, Array]]:
    """Return rotation (3, 3) and shift (3,) of the root and of each link."""
    found = [(np.eye(3), np.zeros(3))]
    for axis, origin, angle in zip(chain.axes, chain.origins, angles, strict=True):
        rotation, shift = found[-1]
        turned = rotation @ Rotation.from_rotvec(angle * axis).as_matrix()
        found.append((turned, shift + rotation @ origin - turned @ origin))
    return found


def jacobian(chain: Chain, angles: Array, point: Array, link: int) -> tuple[Array, Array]:
    """Return the linear and the angular one (3, n) of a ``point`` of the posture of zeros on a link, from 1 on."""
    at = poses(chain, angles)
    position = at[link][0] @ point + at[link][1]
    linear, angular = np.zeros((2, 3, len(angles)))
    for i in range(link):
        rotation, shift = at[i]
        angular[:, i] = rotation @ chain.axes[i]
        linear[:, i] = np.cross(angular[:, i], position - rotation @ chain.origins[i] - shift)
    return linear, angular


def inertia(chain: Chain, angles: Array) -> Array:
    """Return H (n, n) = sum m Jv^T Jv + Jw^T R I R^T Jw, without rotors."""
    total = np.zeros((len(angles), len(angles)))
    for link, (rotation, _) in enumerate(poses(chain, angles)[1:], 1):
        linear, angular = jacobian(chain, angles, chain.centers_m[link - 1], link)
        turned = rotation @ chain.inertia_kg_m2[link - 1] @ rotation.T
        total += chain.mass_kg[link - 1] * linear.T @ linear + angular.T @ turned @ angular
    return total


def bias(chain: Chain, angles: Array, speeds: Array) -> Array:
    """Return H' q' - d(q'^T H q') / 2 dq + dV / dq (n,), its derivatives by central differences."""
    step, n = 1e-5, len(angles)
    slope = [
        (inertia(chain, angles + step * one) - inertia(chain, angles - step * one)) / (2 * step) for one in np.eye(n)
    ]
    centers = [jacobian(chain, angles, chain.centers_m[k], k + 1)[0][2] for k in range(n)]
    weight = chain.gravity_m_s2 * chain.mass_kg @ np.array(centers)
    change = np.tensordot(speeds, slope, 1)
    return np.asarray(change @ speeds - [speeds @ one @ speeds / 2 for one in slope] + weight)
