"""Scene around the arm: bodies of simple shapes that are fixed, free to move, or held by springs."""

from __future__ import annotations

import math
from collections import Counter
from dataclasses import dataclass
from typing import Literal

from kendama_cli.errors import ConfigError
from kendama_cli.schema.settings import setting
from kendama_cli.schema.units import UNIT_SLACK

SIZES: dict[str, tuple[str, ...]] = {
    "box": ("edge along x", "edge along y", "edge along z"),
    "cylinder": ("radius", "height along z"),
    "sphere": ("radius",),
    "plane": (),
}
"""What ``size_m`` holds, by shape, in the body's own axes; of a plane all that is below it, against z, is solid."""


@dataclass(frozen=True)
class _Body:
    name: str = setting("Name of the body in messages and logs; no two bodies share one.")
    shape: Literal["box", "cylinder", "sphere", "plane"] = setting("Shape of the body.")
    size_m: tuple[float, ...] = setting("Dimensions of the body, in the order that its shape needs [m].", above=0)
    position_m: tuple[float, float, float] = setting(
        "Position of the centre in the world, or of a point of the plane [m]."
    )
    rotation_wxyz: tuple[float, float, float, float] = setting(
        "Unit quaternion from the body's frame to the world, real part first."
    )
    friction: float = setting(
        "Coefficient of Coulomb friction; a contact has the smaller one of its two bodies.", at_least=0
    )
    restitution: float = setting(
        "Coefficient of restitution; a contact has the product of those of its two bodies.", at_least=0, at_most=1
    )

    def __post_init__(self) -> None:
        desired = SIZES[self.shape]
        if len(self.size_m) != len(desired):
            allowed = f"[{', '.join(desired)}]"
            raise ConfigError("size_m", f"'size_m' is {list(self.size_m)}; allowed for a {self.shape}: {allowed}")
        norm = math.hypot(*self.rotation_wxyz)
        if not abs(norm - 1.0) <= UNIT_SLACK:
            problem = f"'rotation_wxyz' is {list(self.rotation_wxyz)} of length {norm:.4g}; allowed: length 1"
            raise ConfigError("rotation_wxyz", f"{problem}, as [1, 0, 0, 0] for no rotation")


@dataclass(frozen=True)
class StaticBody(_Body):
    """A body that nothing moves; it has no mass."""

    kind: Literal["static"] = setting("The body never moves.")


@dataclass(frozen=True)
class _MovingBody(_Body):
    mass_kg: float = setting("Mass of the body, uniformly distributed [kg].", above=0)

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.shape == "plane":
            raise ConfigError("shape", "'shape' is 'plane' for a body that moves; allowed: box, cylinder, sphere")


@dataclass(frozen=True)
class FreeBody(_MovingBody):
    """A body that moves as gravity and contacts make it."""

    kind: Literal["free"] = setting("The body moves freely.")


@dataclass(frozen=True)
class SprungBody(_MovingBody):
    """A body on a spring and damper in every direction that does not turn: a yielding surface.

    Its springs carry its own weight, so that it rests at ``position_m``.
    """

    kind: Literal["sprung"] = setting("Springs hold the body, which does not rotate.")
    stiffness_n_m: float = setting("Stiffness of the springs that hold the body, in every direction [N/m].", above=0)
    damping_ratio: float = setting("Damping ratio of the springs that hold the body; 1 is critical.", above=0)


SceneBody = StaticBody | FreeBody | SprungBody


@dataclass(frozen=True)
class SceneSettings:
    """Bodies around the arm, or none."""

    bodies: tuple[SceneBody, ...] = setting("Bodies of the scene, in any order.")

    def __post_init__(self) -> None:
        for name, count in Counter(body.name for body in self.bodies).items():
            if count > 1:
                raise ConfigError("bodies", f"'bodies' has {count} bodies called '{name}'; allowed: one of each name")
