"""A rope that no cup is in the way of."""

from __future__ import annotations

from kendama_cli.physics.rope import CupProfile
from kendama_cli.physics.taut_rope import TautRope

NO_CUP = CupProfile(0.0, 0.0, 0.0, 0.0, (0.0, 0.0, 0.0))


def bare_rope(length_m: float) -> TautRope:
    """The rope of a plain pendulum."""
    return TautRope.round(NO_CUP, length_m)
