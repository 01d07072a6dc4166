"""Shortest path of a rope that is tied to the side of the cup: round the wall, over an edge, across an end."""

from __future__ import annotations

import math
from typing import NamedTuple

SAMPLES, MOST_STEPS = 6, 40
SMALL_RAD = 1e-10


class RopePath(NamedTuple):
    """The last point that the rope touches, in the cup's frame, and the rope up to it."""

    x_m: float
    y_m: float
    z_m: float
    used_m: float


def side_path(radius_m: float, rim_m: float, tie_m: float, ball: tuple[float, float, float]) -> RopePath:
    """Return the shortest path from (r, 0, ``tie_m``) round a solid cylinder of heights 0 to ``rim_m`` to ``ball``.

    With rho and phi the ball's distance from the axis and its angle from the tie, and z its height:

    - before the wall's tangent plane, x >= r: straight;
    - else round the wall by a = |phi| - acos(r / rho), then along the tangent of s = sqrt(rho^2 - r^2): on the unrolled
      cylinder a straight line of length sqrt((r a + s)^2 + (z - tie)^2), if it leaves the wall below the rim and above
      the floor;
    - else over the edge at the height c that it would pass, at the angle q:
      min sqrt((r q)^2 + (c - tie)^2) + |p - e(q)|;
    - or over that end of the cup where this is shorter: up or down the wall to one place of the edge, straight across
      the end to another one, and on to the ball.

    The cup's mouth counts as closed. Opposite the tie two ways are as long; there the left one is taken.
    """
    x, y, z = ball
    if x >= radius_m:
        return RopePath(radius_m, 0.0, tie_m, 0.0)
    rho, phi = math.hypot(x, y), abs(math.atan2(y, x))
    out, up, used, left = _beside(radius_m, rim_m, tie_m, (rho, phi, z))
    across = math.hypot(x - radius_m, y)
    for edge in (0.0, rim_m):
        beyond = z > edge if edge == 0.0 else z < edge
        down = abs(tie_m - edge)
        if beyond and rho > radius_m and math.hypot(across, down + abs(z - edge)) < used + left:
            end, over, rest = _over_end(radius_m, down, (rho, phi, abs(z - edge)))
            if over + rest < used + left:
                out, up, used, left = end, edge, over, rest
    return RopePath(radius_m * math.cos(out), math.copysign(radius_m * math.sin(out), y), up, used)


def _beside(
    radius_m: float, rim_m: float, tie_m: float, ball: tuple[float, float, float]
) -> tuple[float, float, float, float]:
    """Round the wall, and over the edge beyond which the ball is: angle and height of the last point, used, left."""
    rho, phi, z = ball
    edge = rim_m if z > tie_m else 0.0
    if rho > radius_m:
        wrapped = phi - math.acos(radius_m / rho)
        tangent = math.sqrt(rho * rho - radius_m * radius_m)
        fraction = radius_m * wrapped / (radius_m * wrapped + tangent)
        leaves = tie_m + (z - tie_m) * fraction
        if 0.0 <= leaves <= rim_m:
            length = math.hypot(radius_m * wrapped + tangent, z - tie_m)
            return wrapped, leaves, fraction * length, (1.0 - fraction) * length
    angle = _edge_angle(radius_m, abs(edge - tie_m), (rho, phi, abs(z - edge)))
    chord = rho * rho + radius_m * radius_m - 2 * rho * radius_m * math.cos(phi - angle)
    left = math.sqrt(max(chord, 0.0) + (z - edge) * (z - edge))
    return angle, edge, math.hypot(radius_m * angle, edge - tie_m), left


def _edge_angle(radius_m: float, down_m: float, ball: tuple[float, float, float]) -> float:
    """Return the angle at which the shortest path by ``down_m`` along the wall, and straight on, crosses the edge.

    Newton's method between two samples beside the best one, for nearer places may be farther: there may be two minima.
    """
    r, (rho, phi, beyond) = radius_m, ball
    best, shortest = 0, math.inf
    for k in range(SAMPLES + 1):
        angle = phi * k / SAMPLES
        chord = max(rho * rho + r * r - 2 * rho * r * math.cos(phi - angle), 0.0)
        path = math.hypot(r * angle, down_m) + math.sqrt(chord + beyond * beyond)
        if path < shortest:
            best, shortest = k, path
    low, high = phi * max(best - 1, 0) / SAMPLES, phi * min(best + 1, SAMPLES) / SAMPLES
    angle = phi * best / SAMPLES
    for _ in range(MOST_STEPS):
        sine, cosine = rho * r * math.sin(phi - angle), rho * r * math.cos(phi - angle)
        path, rest = math.hypot(r * angle, down_m), math.sqrt(rho * rho + r * r - 2 * cosine + beyond * beyond)
        slope = r * r * angle / path - sine / rest
        bend = (r * down_m) ** 2 / path**3 + (cosine - sine * sine / (rest * rest)) / rest
        if slope > 0.0:
            high = angle
        else:
            low = angle
        better = angle - slope / bend if bend > 0.0 else high
        if not low < better < high:
            better = 0.5 * (low + high)
        moved, angle = abs(better - angle), better
        if moved < SMALL_RAD:
            break
    return angle


def _over_end(radius_m: float, down_m: float, ball: tuple[float, float, float]) -> tuple[float, float, float]:
    """Go along the wall by ``down_m`` to the edge, across to the edge again, and on: last angle, used, remaining.

    ``ball`` is its distance from the axis, its angle from the tie and how far it is on the wall's side of the end. A
    rope that would slip off the end gives an infinite length.
    """
    rho, phi, beyond = ball
    r, first, last = radius_m, 0.0, phi
    for _ in range(MOST_STEPS):
        half = 0.5 * (last - first)
        path, sine, cosine = (
            math.hypot(r * first, down_m),
            rho * r * math.sin(phi - last),
            rho * r * math.cos(phi - last),
        )
        rest = math.sqrt(rho * rho + r * r - 2 * cosine + beyond * beyond)
        chord, curl = r * math.cos(half), 0.5 * r * math.sin(half)
        slope_1, slope_2 = r * r * first / path - chord, chord - sine / rest
        bend_1 = (r * down_m) ** 2 / path**3 - curl
        bend_2 = (cosine - sine * sine / (rest * rest)) / rest - curl
        det = bend_1 * bend_2 - curl * curl
        if bend_1 <= 0.0 or det <= 0.0:
            return 0.0, math.inf, 0.0
        step_1, step_2 = (bend_2 * slope_1 - curl * slope_2) / det, (bend_1 * slope_2 - curl * slope_1) / det
        first, last = first - step_1, last - step_2
        if not (-0.1 <= first <= last <= math.pi + 0.1):
            return 0.0, math.inf, 0.0
        if abs(step_1) + abs(step_2) < SMALL_RAD:
            break
    if first < 0.0 or rho * math.cos(phi - last) < r:
        return 0.0, math.inf, 0.0
    rest = math.sqrt(rho * rho + r * r - 2 * rho * r * math.cos(phi - last) + beyond * beyond)
    return last, math.hypot(r * first, down_m) + 2 * r * math.sin(0.5 * (last - first)), rest
