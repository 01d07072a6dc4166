"""The game itself: rope, ball and cup (PAPER.md eq. 1)."""

from __future__ import annotations

from dataclasses import dataclass

from kendama_cli.schema.settings import setting


@dataclass(frozen=True)
class RopeSettings:
    """A spring and damper that never pushes."""

    length_m: float = setting("untensioned length l0 from the tie point to the ball's centre [m]", above=0)
    stiffness_n_m: float = setting("stiffness Ks [N/m]", above=0)
    damping_n_s_m: float = setting("damping Kd [N s/m]", at_least=0)


@dataclass(frozen=True)
class BallSettings:
    """A rigid sphere."""

    mass_kg: float = setting("mass [kg]", above=0)
    radius_m: float = setting("radius [m]", above=0)
    drag_n_s_m: float = setting("linear air drag Ka: force = -Ka velocity [N s/m]", at_least=0)


@dataclass(frozen=True)
class CupSettings:
    """A ring of staves on a floor; the rope is tied under the middle of the floor."""

    radius_m: float = setting("inner radius [m]", above=0)
    depth_m: float = setting("height of the rim over the tie point [m]", above=0)
    wall_m: float = setting("thickness of staves and floor [m]", above=0)
    staves: int = setting("number of staves", at_least=6)
    mass_kg: float = setting("mass with handle [kg]", above=0)
    restitution: float = setting("coefficient of restitution between ball and cup", at_least=0, at_most=1)
    friction: float = setting("Coulomb friction coefficient between ball and cup", at_least=0)


@dataclass(frozen=True)
class GameSettings:
    """What is simulated whatever the robot is."""

    rope: RopeSettings
    ball: BallSettings
    cup: CupSettings
    gravity_m_s2: float = setting("gravity, along -z of the world [m/s^2]", above=0)
