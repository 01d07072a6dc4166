"""Finding the weights from the forcing term that a demonstration needs, for all coordinates at once.

``lwr``    w_j = sum_i psi_j x f / sum_i psi_j x^2, each function by itself (the paper's), repeated on the residual
``ridge``  min |Phi w - f|^2 + lambda |w|^2, all functions together

Both read f = e'' + D e' + K e of the distance to the goal e = y - g (eq. 3 solved for f), so they need derivatives of
the samples; ``position_fit`` needs none.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from kendama_cli.motion.basis import Basis, activations
from kendama_cli.motion.moving_goal import goal_path
from kendama_cli.motion.phase import phase
from kendama_cli.schema.arrays import Array

if TYPE_CHECKING:
    from kendama_cli.motion.local_cubics import Derivatives


def target_force(motion: Derivatives, goal: Array, goal_rate: Array, basis: Basis) -> Array:
    """f in the motion's own time; (n, c) for ``goal`` and ``goal_rate`` (c,)."""
    path = goal_path(motion.share, goal, goal_rate)
    w = basis.frequency
    force: Array = motion.second + 2 * w * (motion.rate - path.rate) + w**2 * (motion.position - path.position)
    return force


def locally_weighted(share: Array, force: Array, basis: Basis, *, passes: int) -> Array:
    """Weights (m, c) by locally weighted regression, ``passes`` times on what is left of f (n, c); 1 is the paper's."""
    x = phase(share, basis.decay)
    psi = activations(x, basis.centers, basis.widths)
    phi = basis.features(share)
    energy = psi.T @ x**2
    weights = np.zeros((basis.functions, force.shape[1]))
    for _ in range(passes):
        rest = force - phi @ weights
        weights = weights + (psi.T @ (x[:, None] * rest)) / energy[:, None]
    return weights


def ridge_on_force(share: Array, force: Array, basis: Basis, *, penalty: float) -> Array:
    """Weights (m, c) that fit f (n, c) best; ``penalty`` is lambda over the mean energy of a feature."""
    phi = basis.features(share)
    count = phi.shape[1]
    weight = np.sqrt(penalty * float(np.sum(phi**2)) / count)
    stacked = np.vstack((phi, weight * np.eye(count)))
    right = np.vstack((force, np.zeros((count, force.shape[1]))))
    return np.asarray(np.linalg.lstsq(stacked, right, rcond=None)[0])
