"""The ball on a taut rope in the plane of the swing: its position, motion and equation of motion by its angle alone."""

from __future__ import annotations

import math
from typing import NamedTuple

from kendama_cli.errors import ConfigError
from kendama_cli.physics.rope import CupProfile, pivot
from kendama_cli.settings.game import GameSettings, SideTie


class Ball(NamedTuple):
    """The ball's position and velocity relative to the tie point, along x and z."""

    across_m: float
    above_m: float
    across_m_s: float
    above_m_s: float


class Reach(NamedTuple):
    """The ball's distance from the tie point at an angle, and its first two derivatives by that angle."""

    distance_m: float
    first_m: float
    second_m: float


class TautRope(NamedTuple):
    """A rope of ``length_m`` from a tie on the cup's axis round the upright ``cup``.

    With the ball on the angle phi from hanging, u = (sin phi, -cos phi), the rope is taut at the distance d(phi) from
    the tie with |d u - q| = l - used, q being the last point that it touches: d = l under the cup, less beside and
    above it. ``corners_rad`` are the angles from which on the rope goes round the handle's or the cup's lower edge, the
    cup's and the rim; without a handle the first two are the same edge, and the second angle is never reached.
    """

    length_m: float
    cup: CupProfile
    corners_rad: tuple[float, float, float]

    @classmethod
    def round(cls, cup: CupProfile, length_m: float) -> TautRope:
        """Return a rope of ``length_m`` round ``cup``."""
        used, straight_on = cup.used_m, math.pi
        if cup.floor_m > 0.0:
            side, rest = math.hypot(cup.radius_m - cup.handle_m, cup.floor_m), length_m - used[0]
            out, up = (cup.radius_m - cup.handle_m) / side, cup.floor_m / side
            straight_on = math.atan2(cup.handle_m + rest * out, -rest * up)
        beside = math.atan2(cup.radius_m, -(cup.floor_m + length_m - used[1]))
        return cls(length_m, cup, (0.5 * math.pi, straight_on if cup.floor_m > 0.0 else beside, beside))

    @classmethod
    def of(cls, game: GameSettings, rope_scale: float = 1.0) -> TautRope:
        """Return the game's rope, ``rope_scale`` times as long; raises ConfigError if it leaves the swing's plane."""
        return cls.round(_on_axis(game), game.rope.length_m * rope_scale)

    @classmethod
    def hanging(cls, game: GameSettings, rope_scale: float = 1.0) -> TautRope:
        """Return the rope, ``rope_scale`` times as long, as stretched by the ball that hangs on it at rest."""
        weight_n = game.ball.mass_kg * game.gravity_m_s2
        return cls.round(_on_axis(game), game.rope.length_m * rope_scale + stretch_m(weight_n, game.rope.stiffness_n_m))

    def reach(self, angle_rad: float) -> Reach:
        """Return ``reach`` at an angle within +-pi."""
        return reach(self, angle_rad)

    def ball(self, angle_rad: float, rate_rad_s: float) -> Ball:
        """Return ``ball_on`` at any angle."""
        return ball_on(self, math.remainder(angle_rad, 2.0 * math.pi), rate_rad_s)

    def tension_m_s2(self, angle_rad: float, rate_rad_s: float, cup_m_s2: float, gravity_m_s2: float) -> float:
        """Return the rope's tension over the ball's mass on that path; negative if the rope would go slack.

        Along n, from the last point that the rope touches to the ball: f / m = (g - a).n + v^2 / (l - used).
        """
        ball = self.ball(angle_rad, rate_rad_s)
        out, up, used = pivot(self.cup, abs(ball.across_m), ball.above_m)
        left = self.length_m - used
        n_x, n_z = (ball.across_m - math.copysign(out, ball.across_m)) / left, (ball.above_m - up) / left
        speed2 = ball.across_m_s**2 + ball.above_m_s**2
        return -cup_m_s2 * n_x - gravity_m_s2 * n_z + speed2 / left

    def acceleration_rad_s2(self, angle_rad: float, rate_rad_s: float, cup_m_s2: float, gravity_m_s2: float) -> float:
        """Return phi'' of the taut pendulum whose cup accelerates by ``cup_m_s2`` along x: tension plays no part.

        Along the tangent t = d' u + d w of the ball's way:  t^2 phi'' = t.(g - a) - t.(P'') phi'^2, with
        P'' = (d'' - d) u + 2 d' w. Under the cup that is phi'' = -(g sin phi + a cos phi) / l.
        """
        sine, cosine = math.sin(angle_rad), math.cos(angle_rad)
        distance, slope, bend = self.reach(math.remainder(angle_rad, 2.0 * math.pi))
        along, across = gravity_m_s2 * cosine - cup_m_s2 * sine, -gravity_m_s2 * sine - cup_m_s2 * cosine
        bent = (slope * (bend - distance) + 2.0 * distance * slope) * rate_rad_s * rate_rad_s
        return (slope * along + distance * across - bent) / (slope * slope + distance * distance)


def rope_angle(across_m: float, above_m: float) -> float:
    """Return the angle from straight down of the line from the tie to a ball there, within +-pi."""
    return math.atan2(across_m, -above_m)


def rope_rate(ball: Ball) -> float:
    """Return the angular velocity of that line [rad/s]."""
    across, above = ball.across_m, ball.above_m
    return (above * -ball.across_m_s + across * ball.above_m_s) / (across * across + above * above)


def stretch_m(weight_n: float, stiffness_n_m: float) -> float:
    """Return by how much a ball that hangs at rest stretches its rope, m g / Ks."""
    return weight_n / stiffness_n_m


def time_scale(rope_scale: float) -> float:
    """Return sqrt(s), the times on a rope s times as long over those on the other: similarity under one gravity.

    A pendulum with all lengths times s and all times times sqrt(s) obeys the same equations of motion, with the same
    accelerations.
    """
    return math.sqrt(rope_scale)


def reach(rope: TautRope, angle_rad: float) -> Reach:
    """Return d, d' and d'' at an angle within +-pi.

    With c = u.q, w.q = dc/dphi and S = sqrt((l - used)^2 - q^2 + c^2):  d = c + S,  d' = w.q d / S.
    """
    angle, side = abs(angle_rad), -1.0 if angle_rad < 0.0 else 1.0
    first, second, third = rope.corners_rad
    cup = rope.cup
    if angle <= first:
        return Reach(rope.length_m, 0.0, 0.0)
    out, up, used = cup.handle_m, 0.0, cup.used_m[0]
    if angle > third:
        out, up, used = cup.radius_m, cup.rim_m, cup.used_m[2]
    elif angle > second:
        out, up, used = cup.radius_m, cup.floor_m, cup.used_m[1]
    sine, cosine, left = math.sin(angle), math.cos(angle), rope.length_m - used
    along, turned = sine * out - cosine * up, cosine * out + sine * up
    root = math.sqrt(left * left - out * out - up * up + along * along)
    distance = along + root
    slope = turned * distance / root
    bend = (turned * slope - along * distance) / root - turned * distance * along * turned / (root * root * root)
    return Reach(distance, side * slope, bend)


def ball_on(rope: TautRope, angle_rad: float, rate_rad_s: float) -> Ball:
    """Return where the ball is at ``angle_rad`` within +-pi on the taut rope, and how it moves with ``rate_rad_s``."""
    sine, cosine = math.sin(angle_rad), math.cos(angle_rad)
    distance, slope, _ = reach(rope, angle_rad)
    along, across = slope * rate_rad_s, distance * rate_rad_s
    return Ball(distance * sine, -distance * cosine, along * sine + across * cosine, across * sine - along * cosine)


def _on_axis(game: GameSettings) -> CupProfile:
    """Return the cup round which a rope stays in the plane of the swing; raises ConfigError for a tie at the side."""
    if isinstance(game.cup.tie, SideTie):
        raise ConfigError(
            "game.cup.tie.kind",
            "'game.cup.tie.kind' is side: the rope goes round the wall, out of the plane in which the swing-up, its "
            "engines and the game's estimator have the ball; choose game/cup=floor or handle there; imitation up to "
            "'adapt' takes a tie at the side",
        )
    return CupProfile.of(game.cup)
