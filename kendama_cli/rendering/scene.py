"""Scene of a virtual camera: poses, and nothing of the model behind them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from kendama_cli.schema.arrays import Array


@dataclass(frozen=True)
class ScenePose:
    """Poses of the bodies at one instant, in the world frame."""

    ball_m: Array
    """(3,) centre"""
    cup_m: Array
    """(3,) the rope's tie point, under the centre of the cup's floor"""
    cup_rotation: Array
    """(3, 3) cup axes in the world; the third column points out of the opening"""
    rope_m: Array
    """(k, 3) points along the rope; k = 0 shows none"""
    arm_m: Array
    """(j, 3) joints of the arm from base to tip, drawn as rods; j = 0 shows none"""
    links: Array = field(default_factory=lambda: np.empty((0, 3, 4)))
    """(n, 3, 4) rotation and position [R | p] of each link whose mesh the camera has, in the same order"""

    def moved(self, rotation: Array, shift_m: Array) -> ScenePose:
        """Return the scene with every point p at ``rotation`` (3, 3) p + ``shift_m`` (3,)."""
        ball, cup, rope, arm = (p @ rotation.T + shift_m for p in (self.ball_m, self.cup_m, self.rope_m, self.arm_m))
        links = rotation @ self.links
        links[..., 3] += shift_m
        return ScenePose(ball, cup, rotation @ self.cup_rotation, rope, arm, links)


Scene = Callable[[float], ScenePose]
"""The scene at a time [s]; a camera asks for several times within one exposure."""


def hanging_rope(tie_m: Array, ball_m: Array, length_m: float, n_points: int = 9) -> Array:
    """Return points (n, 3) of a rope of ``length_m`` from ``tie_m`` to ``ball_m``: straight if taut, else a
    parabola.

    The sag d of a shallow parabola over a chord c is c sqrt(3/8 (l/c - 1)) (from l = c + 8 d^2 / (3 c)); it is only
    appearance, and no pose depends on it.
    """
    chord = float(np.linalg.norm(ball_m - tie_m))
    part = np.linspace(0.0, 1.0, n_points)
    points = tie_m + part[:, None] * (ball_m - tie_m)
    slack = max(length_m / max(chord, 1e-3) - 1.0, 0.0)
    points[:, 2] -= min(chord * np.sqrt(3 / 8 * slack), length_m / 2) * 4 * part * (1 - part)
    return points
