"""The body of one game: rope, ball, air and rebound as they were sampled or measured for it."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class SampledBody:
    """Parameters of a game that another physics needs beside its settings.

    ``drag`` are k1 [N s/m] and k2 [N s^2/m^2] of the ball in air, ``restitution`` the part of its speed that the ball
    keeps at the cup.
    """

    rope_m: float
    ball_kg: float
    drag: tuple[float, float]
    restitution: float
    rope_kg: float
