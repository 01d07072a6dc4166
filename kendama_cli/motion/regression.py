"""Finding the weights of the forcing term: three ways, each for all coordinates at once.

``lwr``       w_j = sum_i psi_j x f / sum_i psi_j x^2, each function by itself (the paper's), repeated on the residual
``ridge``     min |Phi w - f|^2 + lambda |w|^2, all functions together, f = y'' + D y' - K (g - y)
``position``  min |B w - (y - y_free)|^2 + lambda |w|^2: y is linear in w, so no derivative of the samples is needed
"""

from __future__ import annotations

import numpy as np

from kendama_cli.artifacts.checks import Array
from kendama_cli.motion.basis import activations, features
from kendama_cli.motion.integration import settle, solve
from kendama_cli.motion.phase import phase
from kendama_cli.motion.resampling import Swing

STEPS = 500
"""Integration steps for the responses to single functions; their error is far below a recording's noise."""


def target_force(swing: Swing, stiffness: float) -> Array:
    """f = y'' + D y' - K (g - y) in the swing's own time (eq. 3 solved for f); (n, c)."""
    damping = 2 * np.sqrt(stiffness)
    force: Array = swing.second + damping * swing.rate - stiffness * (swing.goal_m - swing.position_m)
    return force


def locally_weighted(
    swing: Swing, centers: Array, widths: Array, *, stiffness: float, decay: float, passes: int
) -> Array:
    """Weights (c, m) by locally weighted regression, ``passes`` times on what is left of f; 1 is the paper's."""
    x = phase(swing.share, decay)
    psi = activations(x, centers, widths)
    phi = features(x, centers, widths)
    energy = psi.T @ x**2
    force = target_force(swing, stiffness)
    weights = np.zeros((centers.size, force.shape[1]))
    for _ in range(passes):
        rest = force - phi @ weights
        weights = weights + (psi.T @ (x[:, None] * rest)) / energy[:, None]
    return np.ascontiguousarray(weights.T)


def ridge_on_force(
    swing: Swing, centers: Array, widths: Array, *, stiffness: float, decay: float, penalty: float
) -> Array:
    """Weights (c, m) that fit f best; ``penalty`` is lambda over the mean energy of a feature."""
    phi = features(phase(swing.share, decay), centers, widths)
    return _least_squares(phi, target_force(swing, stiffness), penalty)


def least_squares_on_position(
    swing: Swing, centers: Array, widths: Array, *, stiffness: float, decay: float, penalty: float
) -> Array:
    """Weights (c, m) whose motion passes nearest to the samples; ``penalty`` is lambda over the mean energy."""
    frequency = float(np.sqrt(stiffness))
    count = len(centers)
    responses = solve(
        lambda share: features(phase(share, decay), centers, widths), np.zeros(count), np.zeros(count), frequency, STEPS
    ).at(swing.share)
    origin = np.zeros_like(swing.goal_m)
    free = settle(origin, swing.start_rate, swing.goal_m, frequency, swing.share)
    return _least_squares(responses.position, swing.position_m - free.position, penalty)


def _least_squares(columns: Array, wanted: Array, penalty: float) -> Array:
    """min |A w - b|^2 + lambda |w|^2 by a stacked system (better conditioned than the normal equations); (c, m)."""
    count = columns.shape[1]
    weight = np.sqrt(penalty * float(np.sum(columns**2)) / count)
    stacked = np.vstack((columns, weight * np.eye(count)))
    right = np.vstack((wanted, np.zeros((count, wanted.shape[1]))))
    return np.ascontiguousarray(np.linalg.lstsq(stacked, right, rcond=None)[0].T)
