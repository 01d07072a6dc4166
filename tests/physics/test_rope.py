"""The rope round the cup: the shortest way, and a force that never pushes and never makes energy."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from kendama_cli.physics.rope import CupProfile, RopeLaw, pivot, rope_pull
from kendama_cli.physics.side_rope import side_path
from kendama_cli.schema.settings import build
from kendama_cli.settings.game import CupSettings, GameSettings
from tests.physics.bare_rope import NO_CUP
from tests.shipped_conf import plain

GAME = build(GameSettings, plain("game", "kendama"), "game")
HANDLE = build(CupSettings, plain("game/cup", "handle"), "cup")
CUPS = (GAME.cup, HANDLE, build(CupSettings, plain("game/cup", "side"), "cup"))
BARE = RopeLaw(0.40, 2000.0, 2.0, NO_CUP)
ROUND = RopeLaw.of(GAME)


def shortest(cup: CupProfile, across: float, above: float) -> float:
    """By Dijkstra over the edges of the cup's outline that see each other: no use is made of which comes first."""
    h, r = cup.handle_m, cup.radius_m
    corners = [(0.0, 0.0), (h, 0.0), (h, cup.floor_m), (r, cup.floor_m), (r, cup.rim_m), (across, above)]
    solids = [(h, 0.0, cup.floor_m), (r, cup.floor_m, cup.rim_m)]

    def free(a: tuple[float, float], b: tuple[float, float]) -> bool:
        points = np.array(a) + np.linspace(0, 1, 801)[:, None] * (np.array(b) - np.array(a))
        return not any(
            ((points[:, 0] < wide - 1e-9) & (points[:, 1] > low + 1e-9) & (points[:, 1] < high - 1e-9)).any()
            for wide, low, high in solids
        )

    best = {0: 0.0}
    for _ in corners:
        for i, j in np.ndindex(len(corners), len(corners)):
            if i in best and free(corners[i], corners[j]):
                path = best[i] + math.dist(corners[i], corners[j])
                best[j] = min(best.get(j, math.inf), path)
    return best[len(corners) - 1]


@pytest.mark.parametrize("cup", [GAME.cup, HANDLE], ids=["floor", "handle"])
def test_the_way_round_the_cup_is_the_shortest(cup: CupSettings) -> None:
    profile, rng = CupProfile.of(cup), np.random.default_rng(0)

    def solid(a: float, z: float) -> bool:
        cup_there = a < profile.radius_m and profile.floor_m < z < profile.rim_m
        return cup_there or (a < profile.handle_m and 0 < z < profile.floor_m)

    compared = 0
    while compared < 60:
        across, above = rng.uniform(0, 0.3), rng.uniform(-0.3, 0.35)
        if solid(across, above):
            continue
        out, up, used = pivot(profile, across, above)
        path = used + math.hypot(across - out, above - up)
        assert path == pytest.approx(shortest(profile, across, above), abs=1e-5)
        compared += 1


@given(st.floats(0.0, 0.4), st.floats(-0.4, 0.4))
def test_the_way_has_no_step_but_where_the_ball_would_be_in_the_wall(across: float, above: float) -> None:
    """It grows by no more than the ball moves."""
    profile, step = ROUND.cup, 1e-6

    def way(a: float, z: float) -> float:
        out, up, used = pivot(profile, a, z)
        return used + math.hypot(a - out, z - up)

    wall = above > -2 * step and above < profile.rim_m + 2 * step and across < profile.radius_m + 2 * step
    if not wall:
        for da, dz in ((step, 0.0), (0.0, step)):
            assert abs(way(across + da, above + dz) - way(across, above)) <= step * (1 + 1e-6)


@pytest.mark.parametrize("cup", CUPS, ids=["floor", "handle", "side"])
def test_a_cup_that_leans_and_turns_pulls_by_how_its_rope_grows(cup: CupSettings) -> None:
    """f = Ks (l - l0) + Kd l', and the force is -f grad l: by differences of the length, the ball seen by the cup."""
    law = RopeLaw(0.02, 3.0, 0.05, CupProfile.of(cup))
    rng, kinds, h = np.random.default_rng(10003), [], 1e-6
    while len(kinds) < 60:
        posed = Rotation.from_rotvec(rng.normal(0.0, 0.6, 3))
        seen, speed, turning = rng.uniform(-0.2, 0.3, 3), rng.normal(0.0, 1.0, 3), rng.normal(0.0, 3.0, 3)
        if math.hypot(*seen[:2]) < 1.1 * cup.outer_radius_m and -0.02 < seen[2] < cup.rim_m + 0.02:
            continue
        ball = posed.apply(seen)

        def length_m(at: np.ndarray, s: float = 0.0, posed: Any = posed, turning: Any = turning) -> float:
            there = Rotation.from_rotvec(s * turning) * posed
            return law.cup.path_length_m(*there.inv().apply(at).tolist())

        ahead, here, past = (length_m(ball + s * speed, s) for s in (h, 0.0, -h))
        if abs(ahead + past - 2 * here) > 1e-10:  # two ways are as long, or a turn of the rope begins or ends
            continue
        side, _, axis = posed.as_matrix().T
        rates = np.cross(turning, axis), side, np.cross(turning, side)
        made = rope_pull(law, tuple(ball), tuple(speed), tuple(axis), *(tuple(one) for one in rates))
        slope = np.array([length_m(ball + one) - length_m(ball - one) for one in h * np.eye(3)]) / (2 * h)
        tension = max(3.0 * (here - 0.02) + 0.05 * (ahead - past) / (2 * h), 0.0)
        assert made.tension_n == pytest.approx(tension, rel=1e-5)
        assert made.force_n == pytest.approx(-tension * slope, abs=1e-4 * tension)
        used = pivot(law.cup, math.hypot(*seen[:2]), seen[2])[2]
        if law.cup.side_m:
            used = side_path(cup.outer_radius_m, cup.rim_m, law.cup.side_m, tuple(seen)).used_m
        elif seen[2] > 0.0:
            side = posed.apply([*seen[:2], 0.0]) / math.hypot(*seen[:2])
        kinds.append(used)
        assert made.pivot_m == pytest.approx(ball - (here - used) * slope, abs=1e-5)
        assert made.side == pytest.approx(side)
    assert len({round(one, 9) for one in kinds}) >= 3


def test_a_slack_rope_has_no_force() -> None:
    assert rope_pull(ROUND, (0.0, 0.0, -0.399), (0.0, 0.0, -5.0)).tension_n == 0.0


def test_a_taut_rope_pulls_with_spring_and_damper() -> None:
    exerted = rope_pull(ROUND, (0.0, 0.0, -0.41), (0.0, 0.0, -0.5))
    assert exerted.tension_n > 0.0
    assert exerted.force_n == pytest.approx((0.0, 0.0, 2000 * 0.01 + 2 * 0.5))
    assert exerted.pivot_m == (0.0, 0.0, 0.0)


def test_a_damper_that_outweighs_the_spring_gives_no_push() -> None:
    assert rope_pull(ROUND, (0.0, 0.0, -0.4001), (0.0, 0.0, 5.0)).tension_n == 0.0


@pytest.mark.parametrize(("dt", "ripple"), [(1e-3, 1e-2), (1e-4, 1e-3)])
@pytest.mark.parametrize("start", [(0.3, 0.0, 0.2, 0.0), (0.05, 0.35, -1.5, 2.0), (0.39, 0.1, 0.0, -3.0)])
@pytest.mark.parametrize("law", [BARE, ROUND], ids=["bare", "round"])
def test_energy_never_grows_in_a_passive_rope(law: RopeLaw, start, dt: float, ripple: float) -> None:
    mass, gravity = 0.05, 9.81
    x, z, vx, vz = start
    peaks = []
    for _ in range(20):  # the peak over each 0.25 s
        peak = 0.0
        for _ in range(round(0.25 / dt)):
            exerted = rope_pull(law, (x, 0.0, z), (vx, 0.0, vz))
            force = exerted.force_n
            vx, vz = vx + dt * force[0] / mass, vz + dt * (force[2] / mass - gravity)
            x, z = x + dt * vx, z + dt * vz
            out, up, used = pivot(law.cup, abs(x), z)
            stretch = max(used + math.hypot(abs(x) - out, z - up) - law.length_m, 0.0)
            potential = mass * gravity * (z + 1.0) + 0.5 * law.stiffness_n_m * stretch**2
            peak = max(peak, 0.5 * mass * (vx * vx + vz * vz) + potential)
        peaks.append(peak)
    # while the rope is taut the energy of semi-implicit Euler ripples, in proportion to dt
    assert all(later <= earlier + ripple for earlier, later in pairwise(peaks))
    assert peaks[-1] < peaks[0] - 0.02
