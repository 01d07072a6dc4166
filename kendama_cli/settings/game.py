"""The game itself: rope, ball, cup and air (equations.md eq. 1)."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

from kendama_cli.errors import ConfigError
from kendama_cli.schema.settings import setting

FROM_EDGE_M = 0.002
"""A tie on the wall is at least so far from rim and floor."""


@dataclass(frozen=True)
class RopeSettings:
    """A spring and damper without mass that never pushes."""

    length_m: float = setting(
        "Length l0 of the rope without tension, from the tie point to the ball's centre [m].", above=0
    )
    stiffness_n_m: float = setting("Stiffness Ks of the rope [N/m].", above=0)
    damping_n_s_m: float = setting("Damping Kd of the rope [N s/m].", at_least=0)


@dataclass(frozen=True)
class BallSettings:
    """A rigid sphere."""

    mass_kg: float = setting("Mass of the ball [kg].", above=0)
    radius_m: float = setting("Radius of the ball [m].", above=0)


@dataclass(frozen=True)
class QuadraticAir:
    """Quadratic drag of a sphere, and of a string that rotates about its other end."""

    kind: Literal["quadratic"]
    density_kg_m3: float = setting("Density of the air [kg/m^3].", at_least=0)
    ball_coefficient: float = setting("Drag coefficient of the ball.", at_least=0)
    string_coefficient: float = setting("Drag coefficient of the string, for air flow across it.", at_least=0)
    string_diameter_m: float = setting("Diameter of the string [m].", at_least=0)


@dataclass(frozen=True)
class LinearAir:
    """Linear drag as in the paper (equations.md eq. 1)."""

    kind: Literal["linear"]
    drag_n_s_m: float = setting("Coefficient Ka of the linear air drag: force = -Ka velocity [N s/m].", at_least=0)


@dataclass(frozen=True)
class MeasuredAir:
    """Measured coefficients of the drag of ball and string together."""

    kind: Literal["measured"]
    linear_n_s_m: float = setting("Linear coefficient k1 of the drag: force = -(k1 + k2 |v|) v [N s/m].", at_least=0)
    quadratic_n_s2_m2: float = setting(
        "Quadratic coefficient k2 of the drag: force = -(k1 + k2 |v|) v [N s^2/m^2].", at_least=0
    )


@dataclass(frozen=True)
class FloorTie:
    """The rope is tied under the centre of the cup's floor."""

    kind: Literal["floor"]


@dataclass(frozen=True)
class HandleTie:
    """The rope is tied to the lower end of a round handle under the cup, on the axis."""

    kind: Literal["handle"]
    length_m: float = setting("Height of the floor's underside above the tie point [m].", above=0)
    radius_m: float = setting("Radius of the handle [m].", above=0)


@dataclass(frozen=True)
class SideTie:
    """The rope is tied to the outside of the cup's wall."""

    kind: Literal["side"]
    below_rim_m: float = setting("Depth of the tie point below the rim [m].", above=0)
    angle_deg: float = setting(
        "Angle of the tie point about the cup's axis, measured from x of the cup's frame [deg].",
        at_least=-180,
        at_most=180,
    )


@dataclass(frozen=True)
class CupSettings:
    """A ring of staves on a floor, and where the rope is tied to it."""

    radius_m: float = setting("Inner radius of the cup [m]. A wider cup is easier to hit.", above=0)
    depth_m: float = setting("Height of the rim above the floor's underside [m].", above=0)
    wall_m: float = setting("Thickness of staves and floor [m].", above=0)
    staves: int = setting("Number of flat staves that form the wall.", at_least=6)
    mass_kg: float = setting("Mass of the cup with its handle [kg].", above=0)
    restitution: float = setting(
        "Coefficient of restitution between ball and cup. A ball bounces out more easily at larger values.",
        at_least=0,
        at_most=1,
    )
    friction: float = setting("Coefficient of Coulomb friction between ball and cup.", at_least=0)
    tie: FloorTie | HandleTie | SideTie = setting("Point at which the rope is tied to the cup.")

    def __post_init__(self) -> None:
        if self.depth_m <= self.wall_m:
            raise ConfigError(
                "depth_m",
                f"'depth_m' is {self.depth_m:g}: the floor would fill the cup; allowed: above wall_m, which is "
                f"{self.wall_m:g}",
            )
        if isinstance(self.tie, HandleTie) and self.tie.radius_m > self.outer_radius_m:
            raise ConfigError(
                "tie.radius_m",
                f"'tie.radius_m' is {self.tie.radius_m}: the handle would be wider than the cup; allowed: up to "
                f"radius_m + wall_m, which is {self.outer_radius_m:g}",
            )
        lowest_m = self.depth_m - FROM_EDGE_M
        if isinstance(self.tie, SideTie) and not FROM_EDGE_M <= self.tie.below_rim_m <= lowest_m:
            raise ConfigError(
                "tie.below_rim_m",
                f"'tie.below_rim_m' is {self.tie.below_rim_m:g}: the tie would not be on the wall; allowed: "
                f"{FROM_EDGE_M:g} to {lowest_m:g}, {FROM_EDGE_M:g} m from both edges of the wall (cup.depth_m)",
            )

    @property
    def outer_radius_m(self) -> float:
        """Radius of the cylinder that the rope goes round."""
        return self.radius_m + self.wall_m

    @property
    def floor_m(self) -> float:
        """Height of the floor's underside over the cup's position."""
        return self.tie.length_m if isinstance(self.tie, HandleTie) else 0.0

    @property
    def rim_m(self) -> float:
        """Height of the rim over the cup's position."""
        return self.floor_m + self.depth_m

    @property
    def reach_m(self) -> float:
        """Distance that the cup reaches from its position, whichever way it is turned."""
        return math.hypot(self.outer_radius_m, self.rim_m)

    @property
    def tie_m(self) -> tuple[float, float, float]:
        """Return where the rope is tied, in the cup's frame: at its origin, the cup's position, or on the wall."""
        tie = self.tie
        if not isinstance(tie, SideTie):
            return 0.0, 0.0, 0.0
        angle, out = math.radians(tie.angle_deg), self.outer_radius_m
        return out * math.cos(angle), out * math.sin(angle), self.rim_m - tie.below_rim_m


@dataclass(frozen=True)
class GameSettings:
    """Simulated kendama, the same for every robot."""

    rope: RopeSettings
    ball: BallSettings
    cup: CupSettings
    air: QuadraticAir | LinearAir | MeasuredAir = setting("Law of the air drag on the ball.")
    gravity_m_s2: float = setting("Gravitational acceleration, along -z of the world [m/s^2].", above=0)

    def __post_init__(self) -> None:
        if self.ball.radius_m >= self.cup.radius_m:
            raise ConfigError(
                "ball.radius_m",
                f"'ball.radius_m' is {self.ball.radius_m:g}: the ball does not fit into the cup; allowed: below "
                f"cup.radius_m, which is {self.cup.radius_m:g}",
            )
        around_m = self.way_into_cup_m
        if self.rope.length_m <= around_m:
            raise ConfigError(
                "rope.length_m",
                f"'rope.length_m' is {self.rope.length_m}: the cup is too wide for it; allowed: above {around_m:.4g}, "
                "the path from the tie point round the cup to the centre of its mouth; lengthen the rope or choose a "
                "smaller cup (cup.radius_m, cup.depth_m)",
            )

    @property
    def way_into_cup_m(self) -> float:
        """Path from the tie point over floor and rim to the centre of the mouth [m]: a shorter rope lets no ball in."""
        r, tie = self.cup.outer_radius_m, self.cup.tie
        if isinstance(tie, HandleTie):
            return tie.radius_m + math.hypot(r - tie.radius_m, tie.length_m) + self.cup.depth_m + r
        if isinstance(tie, SideTie):
            return tie.below_rim_m + r
        return r + self.cup.depth_m + r

    @property
    def drag(self) -> tuple[float, float]:
        """k1 [N s/m] and k2 [N s^2/m^2] of the air's force -(k1 + k2 |v|) v on the ball with its string.

        A sphere has k2 = C rho pi R^2 / 2. An element of a string of diameter d that turns with the ball moves with
        v s / l, and a force at s acts on the ball with s / l: together C' rho d l / 8.
        """
        air = self.air
        if isinstance(air, LinearAir):
            return air.drag_n_s_m, 0.0
        if isinstance(air, MeasuredAir):
            return air.linear_n_s_m, air.quadratic_n_s2_m2
        ball = air.ball_coefficient * math.pi * self.ball.radius_m**2
        string = air.string_coefficient * air.string_diameter_m * self.rope.length_m / 4
        return 0.0, 0.5 * air.density_kg_m3 * (ball + string)

    @property
    def drag_per_mass(self) -> tuple[float, float]:
        """The same over the ball's mass: k1 / m [1/s] and k2 / m [1/m]."""
        k1, k2 = self.drag
        return k1 / self.ball.mass_kg, k2 / self.ball.mass_kg
