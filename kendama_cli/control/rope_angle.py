"""How far the ball has swung: what tells when it is time to look for free flight."""

from __future__ import annotations

import math

from kendama_cli.physics.taut_rope import rope_angle
from kendama_cli.schema.arrays import Array


def rope_angle_rad(ball_from_tie_m: Array) -> float:
    """The angle of the line from the tie point to the ball (3,) from straight down, in [0, pi]."""
    x, y, z = (float(value) for value in ball_from_tie_m)
    return rope_angle(math.hypot(x, y), z)
