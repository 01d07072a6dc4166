"""A probe: the tool of a scene that is touched."""

from __future__ import annotations

from dataclasses import dataclass

from kendama_cli.schema.settings import setting


@dataclass(frozen=True)
class ProbeSettings:
    """A rod with a ball at its end, held where the robot holds its tool; the ball's centre is what is controlled."""

    radius_m: float = setting("radius of the ball [m]", above=0)
    mass_kg: float = setting("mass, at the ball's centre [kg]", above=0)
    friction: float = setting("Coulomb friction; of two bodies in contact the smaller holds", at_least=0)
    restitution: float = setting("that of a contact is the product of both bodies'", at_least=0, at_most=1)
