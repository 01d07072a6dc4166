"""The swing's dynamics, limiter, goal and bins as compiled code.

A swing is an array of eight numbers: places of cup x, ball x, ball z; their rates; the rope's last force on the ball
along x and z. ``step`` does the operations of DART in its order
(tests/simulation/swingup/rail_dart.py), ``hold`` and ``fly`` are the loops of SwingUpEnvironment; the tests hold each
pair together bit for bit. Limiter, goal, bins, rope, air and fall are the plain laws themselves.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple, get_type_hints

import numpy as np

from kendama_cli.learning.discretisation import Bins, place_of
from kendama_cli.learning.reward import Window, in_window, within_reach
from kendama_cli.learning.state import swing_direction
from kendama_cli.motion.braking import BrakingLimiter, limited
from kendama_cli.physics.free_fall import drag_n, landing
from kendama_cli.physics.rim_crossing import falls_in
from kendama_cli.physics.rope import CupProfile, RopeLaw, pivot, tension_n
from kendama_cli.physics.taut_rope import Ball, TautRope, ball_on, rope_angle, rope_rate
from kendama_cli.system.compiled import Array, compiled, records

Record = Any
"""An array of one record of the type ``RULES``: the record alone takes ten times as long to hand over."""

DUE, GOAL, OUTSIDE, TIMEOUT = 0, 1, 2, 3
"""How ``hold`` ends: a decision is due, or the swing-up is over (GOAL: in the window, or released there)."""
PEAK, HALF_SWINGS, TOWARDS, SLACK = 0, 1, 2, 3
"""Places in a rollout's tally: maximum |x|, half-swings, direction (-1, 0, 1) of the present one, slack steps."""
TALLY = 4
LONGEST_FLIGHT = 1000
"""Steps after which a flight is given up."""


class Physics(NamedTuple):
    """Constants of the dynamics."""

    step_s: float
    weight_n: float
    per_mass: float
    length_m: float
    stiffness_n_m: float
    damping_n_s_m: float
    drag_n_s_m: float
    drag_n_s2_m2: float
    gravity_m_s2: float
    rim_m: float
    radius_m: float
    floor_m: float
    handle_m: float
    at_edge_m: float
    at_floor_m: float
    at_rim_m: float
    floor_rad: float
    rim_rad: float


class Limits(NamedTuple):
    """Limits of the cup, and the bounds at which a rollout ends."""

    half_width_m: float
    max_speed_m_s: float
    braking_m_s2: float
    max_m_s2: float
    edge_m: float


class Aim(NamedTuple):
    """The goal."""

    nearest_rad: float
    farthest_rad: float
    min_rate_rad_s: float
    max_rate_rad_s: float
    catchable: bool
    caught: bool
    slack_steps: float
    landing_limit_m: float
    catch_acceleration_m_s2: float
    mouth_m: float
    lowest_m: float


def _fields(of: type[NamedTuple]) -> np.dtype[np.void]:
    """Return the type of a record with the fields of ``of``, numbers and truth values."""
    return np.dtype([(name, kind) for name, kind in get_type_hints(of).items()], align=True)


GRID = np.dtype(
    [
        ("distance", bool),
        ("mirrored", bool),
        ("position_edges", np.int64),
        ("velocity_edges", np.int64),
        ("angles", np.int64),
        ("per_rad", float),
        ("longest_s", float),
    ],
    align=True,
)
"""``Bins`` without the edges: how many those of position and velocity are; the rest are the rate's."""
RULES = np.dtype(
    [("physics", _fields(Physics)), ("limits", _fields(Limits)), ("aim", _fields(Aim)), ("grid", GRID)], align=True
)
"""The constants of a rollout as one record."""

Moment = tuple[float, float, float, float, float, float, float, float]


@compiled
def _rope(p: Physics) -> RopeLaw:
    used = p.at_edge_m, p.at_floor_m, p.at_rim_m
    cup = CupProfile(p.radius_m, p.floor_m, p.rim_m, p.handle_m, used, 0.0)
    return RopeLaw(p.length_m, p.stiffness_n_m, p.damping_n_s_m, cup)


@compiled
def _moved(s: Moment, command: float, p: Physics) -> Moment:
    """Advance one time step: v += h a, q += h v with the forces of the old state (semi-implicit Euler)."""
    cup_x, ball_x, ball_z, cup_v, ball_vx, ball_vz, _, _ = s
    across, across_rate = ball_x - cup_x, ball_vx - cup_v
    push_x, _, push_z = drag_n(p.drag_n_s_m, p.drag_n_s2_m2, (cup_v + across_rate, 0.0, ball_vz))
    law = _rope(p)
    around, up, used = pivot(law.cup, abs(across), ball_z)
    way_x, way_z = across - math.copysign(around, across), ball_z - up
    left = math.sqrt(way_x * way_x + way_z * way_z)
    tension = tension_n(law, used, left, way_x * across_rate + way_z * ball_vz)
    k = -tension / left if tension > 0.0 else 0.0
    rope_x, rope_z = k * way_x, k * way_z
    push_x += rope_x
    push_z += rope_z
    cup_v += command * p.step_s
    ball_vx += p.per_mass * push_x * p.step_s
    ball_vz += p.per_mass * (push_z - p.weight_n) * p.step_s
    cup_x += cup_v * p.step_s
    ball_x += ball_vx * p.step_s
    ball_z += ball_vz * p.step_s
    return cup_x, ball_x, ball_z, cup_v, ball_vx, ball_vz, rope_x, rope_z


@compiled
def step(s: Array, command: float, p: Physics) -> None:
    """Advance ``s`` by one time step."""
    moved = _moved((s[0], s[1], s[2], s[3], s[4], s[5], s[6], s[7]), command, p)
    s[0], s[1], s[2], s[3], s[4], s[5], s[6], s[7] = moved


@compiled
def _ball(s: Array) -> Ball:
    return Ball(s[1] - s[0], s[2], s[4] - s[3], s[5])


@compiled
def _limited(command: float, s: Array, p: Physics, w: Limits) -> float:
    limiter = BrakingLimiter(w.half_width_m, w.max_speed_m_s, w.braking_m_s2, w.max_m_s2, p.step_s)
    return limited(limiter, command, s[0], s[3])


@compiled
def reached(s: Array, p: Physics, aim: Aim) -> bool:
    """Return True if ``s`` lies in the window and, where that is asked for, a catch from there is predicted."""
    if s[2] < aim.lowest_m:
        return False
    ball = _ball(s)
    angle, rate = rope_angle(ball.across_m, ball.above_m), rope_rate(ball)
    window = Window(aim.nearest_rad, aim.farthest_rad, aim.min_rate_rad_s, aim.max_rate_rad_s)
    if not in_window(window, angle, rate):
        return False
    if not aim.catchable:
        return True
    rope = TautRope(p.length_m, _rope(p).cup, (0.5 * math.pi, p.floor_rad, p.rim_rad))
    found = landing(s[0], s[3], ball_on(rope, angle, rate), p.rim_m, p.gravity_m_s2)
    return within_reach(found, aim.landing_limit_m, aim.catch_acceleration_m_s2)


@compiled
def advance(  # noqa: PLR0917
    s: Array, tally: Array, command: float, gain: float, p: Physics, w: Limits, aim: Aim
) -> int:
    """Advance the swing ``s`` and its ``tally`` by a step under the limited command; return how it ends, or DUE."""
    step(s, _limited(command, s, p, w) * gain, p)
    x_m = abs(s[0])
    if x_m > tally[PEAK]:
        tally[PEAK] = x_m
        if x_m > w.edge_m:
            return OUTSIDE
    towards = swing_direction(rope_rate(_ball(s)), int(tally[TOWARDS]))
    if towards != tally[TOWARDS]:
        tally[TOWARDS] = towards
        tally[HALF_SWINGS] += 1.0
    if not reached(s, p, aim):
        tally[SLACK] = 0.0
        return DUE
    if not aim.caught:
        return GOAL
    tally[SLACK] = tally[SLACK] + 1.0 if s[6] == 0.0 and s[7] == 0.0 else 0.0
    return GOAL if tally[SLACK] >= aim.slack_steps else DUE


@compiled
def hold(  # noqa: PLR0917
    s: Array,
    tally: Array,
    reading: Array,
    errors: Array,
    k: int,
    command: float,
    gain: float,
    before: float,
    gain_before: float,
    delay: int,
    look_s: float,
    rules: Record,
    edges: Array,
) -> tuple[int, int]:
    """Hold ``command``, decided in step ``k`` on ``reading``, until the next decision is due; its step, and the end.

    It takes effect after ``delay`` steps; until then the one ``before`` does.

    ``reading`` (cup x, its velocity, angle, rate) is overwritten by the one that makes the decision due: not before
    ``look_s`` the first in another bin, or after the longest time. ``errors`` (2, steps) are those of angle and rate;
    ``rules`` and ``edges`` are ``packed``, because tuples take longer to hand over than the steps take.
    """
    # not through a variable that holds rules[0]: measured, that takes 1.8 times as long
    p, w, aim, grid = rules[0].physics, rules[0].limits, rules[0].aim, rules[0].grid
    n, m = grid.position_edges, grid.position_edges + grid.velocity_edges
    bins = Bins(
        distance=grid.distance,
        mirrored=grid.mirrored,
        position=edges[:n],
        velocity=edges[n:m],
        rate=edges[m:],
        angles=grid.angles,
        per_rad=grid.per_rad,
    )
    angle_errors, rate_errors = errors
    here = place_of(bins, reading[0], reading[1], reading[2], reading[3])
    chosen_s, effective = k * p.step_s, k + delay
    while True:
        if k < effective:
            end = advance(s, tally, before, gain_before, p, w, aim)
        else:
            end = advance(s, tally, command, gain, p, w, aim)
        k += 1
        if end != DUE:
            return k, end
        if k == angle_errors.size:
            return k, TIMEOUT
        t_s = k * p.step_s
        if t_s >= look_s:
            reading[0], reading[1] = s[0], s[3]
            ball = _ball(s)
            reading[2] = rope_angle(ball.across_m, ball.above_m) + angle_errors[k]
            reading[3] = rope_rate(ball) + rate_errors[k]
            late = t_s - chosen_s >= grid.longest_s
            if late or place_of(bins, reading[0], reading[1], reading[2], reading[3]) != here:
                return k, DUE


@compiled
def fly(s: Array, at_most: int, max_m_s2: float, p: Physics, w: Limits) -> int:
    """Play the flight after the goal, the cup heading for the landing; return the number of its steps."""
    steps = 0
    while steps < at_most and abs(s[0]) <= w.edge_m:
        found = landing(s[0], s[3], _ball(s), p.rim_m, p.gravity_m_s2)
        if found.time_s <= 0.5 * p.step_s:
            break
        desired = found.acceleration_m_s2
        desired = max(-max_m_s2, min(max_m_s2, desired))
        step(s, _limited(desired, s, p, w), p)
        steps += 1
    return steps


@compiled
def is_caught(s: Array, mouth_m: float, p: Physics, w: Limits) -> bool:
    """Return True if a flight that ended at ``s`` ended in the cup's mouth."""
    return falls_in(s[0], s[1] - s[0], s[2] - p.rim_m, s[5], mouth_m, w.edge_m, p.step_s)


@compiled
def play(swings: Array, commands: Array, steps: int, p: Physics) -> None:
    """Play the bare dynamics of many swings (8, n), in place: hold each row of ``commands`` (m, n) for ``steps``."""
    x, bx, bz, v, bvx, bvz, fx, fz = swings
    for row in commands:
        for _ in range(steps):
            for i in range(row.size):
                now = (x[i], bx[i], bz[i], v[i], bvx[i], bvz[i], fx[i], fz[i])
                x[i], bx[i], bz[i], v[i], bvx[i], bvz[i], fx[i], fz[i] = _moved(now, row[i], p)


def packed(p: Physics, w: Limits, aim: Aim, bins: Bins, longest_s: float) -> tuple[Record, Array]:
    """Pack all constants for ``hold``: one record of the type ``RULES``, and the bins' edges in one array."""
    packed_rules = records(np.zeros(1, RULES))
    rules = packed_rules[0]
    rules["physics"], rules["limits"], rules["aim"] = tuple(p), tuple(w), tuple(aim)
    grid = rules["grid"]
    for name in ("distance", "mirrored", "angles", "per_rad"):
        grid[name] = getattr(bins, name)
    grid["longest_s"] = longest_s
    grid["position_edges"], grid["velocity_edges"] = bins.position.size, bins.velocity.size
    return packed_rules, np.concatenate([bins.position, bins.velocity, bins.rate])


def _load() -> None:
    """Compile, or read from numba's cache, all that a learning environment calls.

    It happens on import, so that processes forked from one that has imported this module need not do it each.
    """
    ones = [1.0] * 18
    p, w, aim = Physics(*ones), Limits(*ones[:5]), Aim._make([*ones[:4], True, False, *ones[:5]])
    bins = Bins(False, False, np.zeros(1), np.zeros(1), np.zeros(1), 18, 3.0)
    s, tally, error = np.ones(8), np.zeros(TALLY), np.zeros((2, 2))
    step(s, 0.0, p)
    hold(s, tally, np.zeros(4), error, 0, 0.0, 1.0, 0.0, 1.0, 0, 1.0, *packed(p, w, aim, bins, 1.0))
    fly(s, 1, 1.0, p, w)
    is_caught(s, 1.0, p, w)


_load()
