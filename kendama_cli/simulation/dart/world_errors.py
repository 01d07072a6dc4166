"""Errors of a world of DART against its controller's beliefs."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class WorldErrors:
    """Errors of one world against its controller's beliefs (see settings.robot.Imperfection).

    The rope is ``rope_scale`` times as long as the game's, and ``ball_start_m`` is how far the ball hangs aside.
    ``rope_kg`` is the mass of its chain of links, None as in the game (0: a spring without mass).
    ``joint_friction_nm`` is Coulomb friction of every joint beyond the known one, ``joint_friction_fraction`` the share
    of each joint's known friction that comes on top of it; ``restitution`` that of ball and cup, None as in the game;
    ``mass_scale`` and ``drag_scale`` are factors on the ball's mass and on the air's force; ``tie_friction_m`` is the
    moment of the rope's friction at its tie over its pull, ``gravity_tilt_rad`` how far gravity leans toward +x for
    the ball; the arm's stiff drive would not show it (g sin 1 deg / Kp is 0.05 mm).
    """

    rope_scale: float = 1.0
    ball_start_m: float = 0.0
    joint_friction_nm: float = 0.0
    joint_friction_fraction: float = 0.0
    restitution: float | None = None
    mass_scale: float = 1.0
    drag_scale: float = 1.0
    tie_friction_m: float = 0.0
    gravity_tilt_rad: float = 0.0
    rope_kg: float | None = None


NO_ERRORS = WorldErrors()
