"""A chain of revolute joints as compiled code: its places, its way along a path, its efforts, its clearance.

Everything is in the frame of the arm's root, z up, and by products of exponentials: a link's rotation R and shift t
carry a point p of the posture of zeros to R p + t, so that axes, origins and inertias are all given in that one
posture. The tests hold each function against DART.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from kendama_cli.artifacts.friction_model import dry_friction
from kendama_cli.system.compiled import Array, compiled

Vector = tuple[float, float, float]
TASK = 5
"""Rows of the task: the tie point's place, and the cup's rotation about x and y."""
MOST_STEPS = 12
TOLERANCE = 1e-8
REACHED = 1e-6
"""A place is reached where the task misses by less, in m and rad."""
DAMPING = 1e-9
LONGEST_STEP_RAD = 0.2
EFFORT_EVERY = 3
"""Efforts cost most and change little from sample to sample: every third is looked at."""
POINTS = 7
"""Points of a capsule's axis at which its distance from the ball's swing is taken."""


class Chain(NamedTuple):
    """n joints and the links that they move, in the posture of zeros and the root's frame."""

    axes: Array
    """(n, 3) unit vectors"""
    origins: Array
    """(n, 3) a point of each axis: the joint's origin"""
    tip_m: Array
    """(3,) origin of the link that holds the handle"""
    tip_turn: Array
    """(3, 3) its frame"""
    mass_kg: Array
    """(n,)"""
    centers_m: Array
    """(n, 3) centres of mass"""
    inertia_kg_m2: Array
    """(n, 3, 3) about the centre of mass"""
    rotor_kg_m2: Array
    """(n,) on the diagonal of H"""
    viscous_nm_s: Array
    coulomb_nm: Array
    stribeck_nm: Array
    stribeck_rad_s: Array
    gravity_m_s2: float


class ToolGeometry(NamedTuple):
    """Geometry of the tool on the tip link, in the posture of zeros and the root's frame."""

    tie_m: Array
    """(3,) the rope's tie point"""
    axis: Array
    """(3,) where the cup opens"""
    mass_kg: float


class IkSettings(NamedTuple):
    """Start of a motion for inverse kinematics, and the cost of each joint's displacement."""

    home: Array
    """(n,)"""
    weights: Array
    """(n,)"""


class Curve(NamedTuple):
    """Joint angles along a parameter s, and how s runs."""

    angles: Array
    """(k, n)"""
    step: float
    velocity: Array
    """(k,) ds/dt"""
    acceleration: float


class CollisionGeometry(NamedTuple):
    """Geometry of the parts that must not collide; heights are above the root."""

    radius_m: Array
    """(n + 2,) of the pedestal, every link, and the handle"""
    floor_m: float
    side: Array
    """(3,) unit normal of the swing plane"""
    swing_m: float
    """radius of the disc that the ball may reach about the tie point"""
    ball_m: float
    cup_m: float
    """radius of the ball about the cup that keeps clear of the links"""


@compiled
def rotated_row(row: Vector, axis: Vector, cosine: float, sine: float) -> Vector:
    """Return a ``row`` of the rotation R times the rotation about the unit ``axis`` (Rodrigues).

    r cos + (1 - cos) (r . a) a + sin (r x a)
    """
    (p, q, s), (x, y, z) = row, axis
    across = (1.0 - cosine) * (p * x + q * y + s * z)
    return (
        p * cosine + across * x + sine * (q * z - s * y),
        q * cosine + across * y + sine * (s * x - p * z),
        s * cosine + across * z + sine * (p * y - q * x),
    )


@compiled
def frames(chain: Chain, angles: Array, rotations: Array, shifts: Array) -> None:
    """Compute rotations (n + 1, 3, 3) and positions (n + 1, 3) of root and links for ``angles`` (n,), into these
    arrays.
    """
    for r in range(3):  # number by number here and below: an array assigned to a row takes seconds to compile
        shifts[0, r] = 0.0
        for k in range(3):
            rotations[0, r, k] = 1.0 if r == k else 0.0
    for i in range(len(angles)):
        axis = chain.axes[i, 0], chain.axes[i, 1], chain.axes[i, 2]
        c, s = math.cos(angles[i]), math.sin(angles[i])
        for r in range(3):  # the rotation so far, times Rodrigues' rotation about the axis
            row = rotations[i, r, 0], rotations[i, r, 1], rotations[i, r, 2]
            rotations[i + 1, r, 0], rotations[i + 1, r, 1], rotations[i + 1, r, 2] = rotated_row(row, axis, c, s)
            shift = shifts[i, r]
            for k in range(3):
                shift += (rotations[i, r, k] - rotations[i + 1, r, k]) * chain.origins[i, k]
            shifts[i + 1, r] = shift


@compiled
def put(turn: Array, shift: Array, point: Array) -> Array:
    """Return the position to which a link's frame maps ``point`` (3,)."""
    made = np.empty(3)
    for r in range(3):
        made[r] = turn[r, 0] * point[0] + turn[r, 1] * point[1] + turn[r, 2] * point[2] + shift[r]
    return made


@compiled
def cross(a: Array, b: Array) -> Array:
    """Return the cross product a x b."""
    return np.array([a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]])


@compiled
def task(chain: Chain, tool: ToolGeometry, rotations: Array, shifts: Array, jacobian: Array) -> Array:
    """Return the tie point and the missing rotation about x and y to upright (5,); ``jacobian`` (5, n) gets the
    Jacobian.
    """
    n = len(chain.axes)
    tie = put(rotations[n], shifts[n], tool.tie_m)
    up = rotations[n, :, 0] * tool.axis[0] + rotations[n, :, 1] * tool.axis[1] + rotations[n, :, 2] * tool.axis[2]
    for i in range(n):
        o, a, t = chain.origins[i], chain.axes[i], rotations[i]
        x = t[0, 0] * a[0] + t[0, 1] * a[1] + t[0, 2] * a[2]
        y = t[1, 0] * a[0] + t[1, 1] * a[1] + t[1, 2] * a[2]
        z = t[2, 0] * a[0] + t[2, 1] * a[1] + t[2, 2] * a[2]
        u = tie[0] - shifts[i, 0] - t[0, 0] * o[0] - t[0, 1] * o[1] - t[0, 2] * o[2]
        v = tie[1] - shifts[i, 1] - t[1, 0] * o[0] - t[1, 1] * o[1] - t[1, 2] * o[2]
        w = tie[2] - shifts[i, 2] - t[2, 0] * o[0] - t[2, 1] * o[1] - t[2, 2] * o[2]
        jacobian[0, i], jacobian[1, i], jacobian[2, i] = y * w - z * v, z * u - x * w, x * v - y * u
        jacobian[3, i], jacobian[4, i] = x, y
    long = max(math.hypot(up[0], up[1]), 1e-9) if up[2] < 0 else 1.0
    return np.array([tie[0], tie[1], tie[2], up[1] / long, -up[0] / long])


@compiled
def solved(square: Array, side: Array) -> Array:
    """Return (A + damping)^-1 b for a symmetric A, given by its lower triangle, by Cholesky's factors."""
    size = len(side)
    found = side.copy()
    lift = 0.0
    for r in range(size):
        lift += DAMPING * square[r, r] / size
    for r in range(size):
        square[r, r] += lift
        for c in range(r + 1):
            for k in range(c):
                square[r, c] -= square[r, k] * square[c, k]
            if c < r:
                square[r, c] /= square[c, c]
        square[r, r] = math.sqrt(max(square[r, r], 1e-300))
        for k in range(r):
            found[r] -= square[r, k] * found[k]
        found[r] /= square[r, r]
    for r in range(size - 1, -1, -1):
        for k in range(r + 1, size):
            found[r] -= square[k, r] * found[k]
        found[r] /= square[r, r]
    return found


@compiled
def least_step(jacobian: Array, change: Array, weights: Array) -> Array:
    """Return the joint step with the least weighted sum of squares (see
    robot_model.inverse_kinematics.weighted_step).
    """
    n = len(weights)
    spread = jacobian / weights
    square = np.zeros((TASK, TASK))
    for r in range(TASK):
        for c in range(r + 1):
            for i in range(n):
                square[r, c] += jacobian[r, i] * spread[c, i]
    side = solved(square, change)
    step = np.zeros(n)
    for i in range(n):
        for r in range(TASK):
            step[i] += spread[r, i] * side[r]
    return step


@compiled
def follow(chain: Chain, tool: ToolGeometry, ik: IkSettings, path_m: Array, whole: bool) -> tuple[Array, Array]:
    """Return the angles (k, n) along ``path_m`` (k, 3) from the tie point at home, each found from the one before.

    Also what the task misses there (k,): a place out of reach is left as near as the steps come; unless the ``whole``
    path is desired, all after it is missed without end.
    """
    n, count = len(ik.home), len(path_m)
    rotations, shifts = np.empty((n + 1, 3, 3)), np.empty((n + 1, 3))
    jacobian = np.empty((TASK, n))
    frames(chain, ik.home, rotations, shifts)
    start = put(rotations[n], shifts[n], tool.tie_m)
    angles, missed = np.empty((count, n)), np.empty(count)
    last = ik.home.copy()
    for k in range(count):
        for _ in range(MOST_STEPS):
            frames(chain, last, rotations, shifts)
            value = task(chain, tool, rotations, shifts, jacobian)
            change = np.empty(TASK)
            for r in range(3):
                change[r] = start[r] + path_m[k, r] - value[r]
            change[3], change[4] = value[3], value[4]
            missed[k] = np.abs(change).max()
            if missed[k] < TOLERANCE:
                break
            step = least_step(jacobian, change, ik.weights)
            last = last + step * min(1.0, LONGEST_STEP_RAD / max(np.abs(step).max(), 1e-12))
        beyond = missed[k] > REACHED and not whole
        for later in range(k, count if beyond else k + 1):
            for i in range(n):
                angles[later, i] = last[i]
            if beyond:
                missed[later] = math.inf
        if beyond:
            break
    return angles, missed


@compiled
def times(turn: Array, inertia: Array, rate: Array) -> Array:
    """Return (R I R^T) w: the inertia (3, 3) of a rotated link times ``rate`` (3,)."""
    own, made = np.zeros(3), np.zeros(3)
    for r in range(3):
        for k in range(3):
            own[r] += turn[k, r] * rate[k]
    for r in range(3):
        part = inertia[r, 0] * own[0] + inertia[r, 1] * own[1] + inertia[r, 2] * own[2]
        for k in range(3):
            made[k] += turn[k, r] * part
    return made


@compiled
def efforts(chain: Chain, tool: ToolGeometry, angles: Array, speeds: Array, changes: Array) -> Array:
    """Return the torques (n,) of the motion by Newton and Euler, with known friction (equations.md eq. 2)."""
    n = len(angles)
    still = np.zeros(3)
    rotations, shifts = np.empty((n + 1, 3, 3)), np.empty((n + 1, 3))
    frames(chain, angles, rotations, shifts)
    axes, positions = np.empty((n, 3)), np.empty((n, 3))
    forces, moments = np.empty((n, 3)), np.empty((n, 3))
    spin, gain = np.zeros(3), np.zeros(3)
    lift = np.array([0.0, 0.0, chain.gravity_m_s2])
    last = still
    for i in range(n):
        axes[i] = put(rotations[i], still, chain.axes[i])
        positions[i] = put(rotations[i], shifts[i], chain.origins[i])
        path = positions[i] - last
        lift = lift + cross(gain, path) + cross(spin, cross(spin, path))
        gain = gain + axes[i] * changes[i] + cross(spin, axes[i]) * speeds[i]
        spin = spin + axes[i] * speeds[i]
        last = positions[i]
        out = put(rotations[i + 1], shifts[i + 1], chain.centers_m[i]) - last
        rotation, own = rotations[i + 1], chain.inertia_kg_m2[i]
        forces[i] = chain.mass_kg[i] * (lift + cross(gain, out) + cross(spin, cross(spin, out)))
        moments[i] = times(rotation, own, gain) + cross(spin, times(rotation, own, spin)) + cross(out, forces[i])
    out = put(rotations[n], shifts[n], tool.tie_m) - last
    held = tool.mass_kg * (lift + cross(gain, out) + cross(spin, cross(spin, out)))
    forces[n - 1] += held
    moments[n - 1] += cross(out, held)
    made = np.empty(n)
    for i in range(n - 1, -1, -1):
        if i < n - 1:
            moments[i] += moments[i + 1] + cross(positions[i + 1] - positions[i], forces[i + 1])
            forces[i] += forces[i + 1]
        ratio = speeds[i] / chain.stribeck_rad_s[i]
        dry = dry_friction(chain.coulomb_nm[i], chain.stribeck_nm[i], ratio)
        made[i] = (
            axes[i] @ moments[i]
            + chain.rotor_kg_m2[i] * changes[i]
            + chain.viscous_nm_s[i] * speeds[i]
            + dry * np.sign(speeds[i])
        )
    return made


@compiled
def peaks(chain: Chain, tool: ToolGeometry, curve: Curve) -> tuple[Array, Array, Array]:
    """Return the maximum velocities, accelerations and efforts (n,) of ``curve``.

        q' = q_s v,   q'' = q_ss v^2 +- q_s a,   v = ds/dt, a = dv/dt

    Derivatives are central differences. A motion in time has v = 1 and a = 0.
    """
    angles, step = curve.angles, curve.step
    count, n = angles.shape
    fastest, strongest, hardest = np.zeros(n), np.zeros(n), np.zeros(n)
    for k in range(1, count - 1):
        speed = (angles[k + 1] - angles[k - 1]) / (2 * step) * curve.velocity[k]
        bend = (angles[k + 1] - 2 * angles[k] + angles[k - 1]) / step**2 * curve.velocity[k] ** 2
        gain = (angles[k + 1] - angles[k - 1]) / (2 * step) * curve.acceleration
        fastest = np.maximum(fastest, np.abs(speed))
        for sign in (1.0, -1.0):
            change = bend + sign * gain
            strongest = np.maximum(strongest, np.abs(change))
            if k % EFFORT_EVERY == 1:
                hardest = np.maximum(hardest, np.abs(efforts(chain, tool, angles[k], speed, change)))
            if curve.acceleration == 0.0:
                break
    return fastest, strongest, hardest


@compiled
def apart(a: Array, b: Array, c: Array, d: Array) -> float:
    """Return the distance between the segments a-b and c-d (Ericson, Real-Time Collision Detection, 5.1.9)."""
    u, v, w = b - a, d - c, a - c
    uu, vv, uv, uw, vw = u @ u, v @ v, u @ v, u @ w, v @ w
    across = uu * vv - uv * uv
    s = min(max((uv * vw - uw * vv) / across, 0.0), 1.0) if across > 1e-12 else 0.0
    t = (uv * s + vw) / vv if vv > 1e-12 else 0.0
    if t < 0.0 or t > 1.0 or vv <= 1e-12:
        t = min(max(t, 0.0), 1.0)
        s = min(max((uv * t - uw) / uu, 0.0), 1.0) if uu > 1e-12 else 0.0
    gap = w + s * u - t * v
    return math.sqrt(gap @ gap)


@compiled
def tip_is_apart(points: Array, i: int, n: int, geometry: CollisionGeometry, tool: ToolGeometry) -> bool:
    """Return True if link ``i`` is far enough along the chain from the cup to be checked against it."""
    between = 0.0
    for j in range(i + 1, n + 2):
        path = points[j + 1] - points[j]
        between += math.sqrt(path @ path)
    return bool(between > 1.2 * (geometry.radius_m[i] + geometry.cup_m))


@compiled
def clearance(
    chain: Chain, tool: ToolGeometry, geometry: CollisionGeometry, angles: Array, every: int
) -> tuple[float, int, int, int]:
    """Return the minimum gap [m] along ``angles`` (k, n), the two parts that have it, and its sample.

    Parts: 0 the pedestal, 1..n the links, n + 1 the handle, n + 2 the cup, n + 3 the ball's swing, -1 the floor.
    Capsules reach from one joint's origin to the next. Two links are compared where the links between them are long
    enough to part them.
    """
    count, n = angles.shape
    rotations, shifts = np.empty((n + 1, 3, 3)), np.empty((n + 1, 3))
    points = np.empty((n + 3, 3))
    minimum, one, two, when = math.inf, 0, 0, 0
    for k in range(0, count, every):
        frames(chain, angles[k], rotations, shifts)
        for i in range(n):
            points[i + 1] = put(rotations[i], shifts[i], chain.origins[i])
        points[0] = points[1]
        points[0, 2] = min(geometry.floor_m, points[1, 2])
        points[n + 1] = put(rotations[n], shifts[n], chain.tip_m)
        tie = points[n + 2] = put(rotations[n], shifts[n], tool.tie_m)
        for i in range(n + 2):
            between = 0.0
            for j in range(i + 2, n + 2):
                path = points[j] - points[j - 1]
                between += math.sqrt(path @ path)
                wide = geometry.radius_m[i] + geometry.radius_m[j]
                if between > 1.2 * wide:
                    gap = apart(points[i], points[i + 1], points[j], points[j + 1]) - wide
                    if gap < minimum:
                        minimum, one, two, when = gap, i, j, k
            if i >= 2 and min(points[i, 2], points[i + 1, 2]) - geometry.floor_m - geometry.radius_m[i] < minimum:
                minimum = min(points[i, 2], points[i + 1, 2]) - geometry.floor_m - geometry.radius_m[i]
                one, two, when = -1, i, k
            if i <= n and tip_is_apart(points, i, n, geometry, tool):
                gap = apart(points[i], points[i + 1], tie, tie) - geometry.radius_m[i] - geometry.cup_m
                if gap < minimum:
                    minimum, one, two, when = gap, i, n + 2, k
            for m in range(POINTS + 1):
                fraction = m / POINTS
                if i == n + 1:  # the handle ends in the plane: a ball's width from the tie point counts
                    fraction *= 0.7
                away = points[i] + fraction * (points[i + 1] - points[i]) - tie
                off = away @ geometry.side
                inside = max(math.sqrt(max(away @ away - off * off, 0.0)) - geometry.swing_m, 0.0)
                gap = math.hypot(off, inside) - geometry.radius_m[i] - geometry.ball_m
                if gap < minimum:
                    minimum, one, two, when = gap, i, n + 3, k
    return minimum, one, two, when
