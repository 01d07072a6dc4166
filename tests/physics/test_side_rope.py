"""A rope that is tied to the side of the cup: the shortest way round it, found without its formulas, and by MuJoCo."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from kendama_cli.errors import ConfigError
from kendama_cli.physics.rope import CupProfile
from kendama_cli.physics.side_rope import side_path
from kendama_cli.physics.taut_rope import TautRope
from kendama_cli.schema.settings import build
from kendama_cli.settings.game import GameSettings
from tests.shipped_conf import plain

GAME = build(GameSettings, plain("game", "kendama") | {"cup": plain("game/cup", "side")}, "game")
R_M, RIM_M = GAME.cup.outer_radius_m, GAME.cup.rim_m
Point = tuple[float, float, float]


def path_length_m(tie_m: float, ball: Point) -> float:
    path = side_path(R_M, RIM_M, tie_m, ball)
    return path.used_m + math.dist(path[:3], ball)


def out_of_the_cup(points: np.ndarray) -> np.ndarray:
    """Points inside are put on the nearest place of the surface."""
    across = np.hypot(points[:, 0], points[:, 1])
    depth = np.array([R_M - across, RIM_M - points[:, 2], points[:, 2]])
    inside, nearest = (depth > 0).all(axis=0), np.argmin(depth, axis=0)
    wall = inside & (nearest == 0)
    points[wall, :2] *= (R_M / np.maximum(across[wall], 1e-9))[:, None]
    points[inside & (nearest == 1), 2] = RIM_M
    points[inside & (nearest == 2), 2] = 0.0
    return points


def tightened_m(begun: list[Any]) -> float:
    """A rope of ever shorter pieces, each end of which goes between its neighbours and out of the cup."""
    rope, lengths = np.array(begun, dtype=float), []
    for pieces in (30, 60, 120, 240):
        along = np.append(0.0, np.cumsum(np.linalg.norm(np.diff(rope, axis=0), axis=1)))
        ends = rope[0].copy(), rope[-1].copy()
        at = np.linspace(0.0, along[-1], pieces + 1)
        rope = out_of_the_cup(np.column_stack([np.interp(at, along, rope[:, k]) for k in range(3)]))
        rope[0], rope[-1] = ends
        for _ in range(400):
            rope[1:-1] = out_of_the_cup(0.5 * (rope[:-2] + rope[2:]))
        lengths.append(float(np.linalg.norm(np.diff(rope, axis=0), axis=1).sum()))
    return 2.0 * lengths[-1] - lengths[-2]  # pieces across an edge cut its corner, half as much when half as long


def shortest_m(tie_m: float, ball: Point) -> float:
    """The shortest of ropes that begin left and right of the wall, below and above, and across an end."""
    x, y, z = ball
    angle, wide, tie = math.atan2(y, x), 1.15 * R_M, [R_M, 0.0, tie_m]
    ropes = []
    for path in (angle % (2 * math.pi), -(-angle % (2 * math.pi))):
        turned, high = np.linspace(0.0, path, 12), np.linspace(tie_m, min(max(z, -0.02), RIM_M + 0.02), 12)
        ropes.append([tie, *np.column_stack([wide * np.cos(turned), wide * np.sin(turned), high]), ball])
    for end in (-0.004, RIM_M + 0.004):
        beside, far = [[wide, 0.0, tie_m], [wide, 0.0, end]], [wide * math.cos(angle), wide * math.sin(angle), end]
        ropes += [[tie, *beside, far, ball], [tie, *beside, ball]]
    return min(tightened_m(rope) for rope in ropes)


BALLS: dict[str, tuple[float, Point]] = {
    "straight": (0.015, (0.15, 0.1, -0.2)),
    "round the wall": (0.035, (-0.1, 0.2, 0.03)),
    "round the wall, then over the lower edge": (0.043, (-0.138, -0.275, -0.289)),
    "down the wall, then straight": (0.015, (-0.218, -0.004, -0.105)),
    "over the rim": (0.03, (-0.1, -0.07, 0.3)),
    "across the mouth": (0.064, (-0.3, 0.01, 0.02)),
    "across the mouth to a ball beside the rim": (0.052, (-0.116, -0.009, 0.065)),
    "under the floor": (0.006, (-0.25, 0.005, 0.03)),
}


@pytest.mark.parametrize("name", BALLS)
def test_the_way_is_what_a_rope_tightens_to(name: str) -> None:
    """On 38 of 40 random places by 0.12 mm at most, what corners leave; on two a piece jumped from face to face."""
    tie_m, ball = BALLS[name]
    assert path_length_m(tie_m, ball) == pytest.approx(shortest_m(tie_m, ball), abs=2e-4)


def least(length: Callable[..., np.ndarray], most: float, angles: int) -> float:
    """Return the least length over so many angles from 0 to ``most``, on a grid and on a finer one about its best."""
    low, high = np.zeros(angles), np.full(angles, most)
    for _ in range(2):
        grid = np.meshgrid(*np.linspace(low, high, 61).T, indexing="ij")
        lengths = length(*grid)
        at, step = np.unravel_index(lengths.argmin(), lengths.shape), (high - low) / 60
        best = np.array([axis[at] for axis in grid])
        low, high = np.maximum(best - step, 0.0), np.minimum(best + step, most)
    return float(lengths.min())


def ways_m(tie_m: float, ball: Point) -> dict[str, float]:
    """The shortest rope of each kind that there is to a ball beyond the tie's tangent plane, its angles tried out."""
    (x, y, z), r = ball, R_M
    rho, phi = math.hypot(x, y), abs(math.atan2(y, x))
    ways = {}
    if rho > r:
        wrapped, tangent = r * (phi - math.acos(r / rho)), math.sqrt(rho**2 - r**2)
        if 0.0 <= tie_m + (z - tie_m) * wrapped / (wrapped + tangent) <= RIM_M:
            ways["wall"] = math.hypot(wrapped + tangent, z - tie_m)

    def onward(last: np.ndarray, edge: float) -> np.ndarray:
        return np.sqrt((rho * np.cos(phi - last) - r) ** 2 + (rho * np.sin(phi - last)) ** 2 + (z - edge) ** 2)

    for name, edge, over in (("floor", 0.0, -z), ("rim", RIM_M, z - RIM_M)):

        def up(first: np.ndarray, edge: float = edge) -> np.ndarray:
            return np.hypot(r * first, edge - tie_m)

        def across(first: np.ndarray, last: np.ndarray, edge: float = edge, up: Any = up) -> np.ndarray:
            length = up(first) + 2 * r * np.sin(np.abs(last - first) / 2) + onward(last, edge)
            return np.where((last < first) | (rho * np.cos(phi - last) < r), np.inf, length)

        if over > 0.0 and "wall" not in ways:
            ways[f"over {name}"] = least(lambda q, up=up, edge=edge: up(q) + onward(q, edge), phi, 1)
        if over < 0.0 and rho > r:
            ways[f"across {name}"] = least(across, phi, 2)
    return ways


def test_the_way_is_the_shortest_of_all_that_there_are() -> None:
    """Random balls: around, behind the cup (where it may go across an end) and over the mouth."""
    rng, kinds = np.random.default_rng(10002), set()
    lows, highs = (
        [[-0.3, -0.2, -0.25], [-0.3, -0.02, -0.05], [-R_M, -0.03, RIM_M]],
        [[R_M, 0.2, 0.3], [-0.036, 0.02, 0.12]],
    )
    highs.append([0.9 * R_M, 0.03, 0.3])
    for k in range(240):
        tie_m, ball = rng.uniform(0.003, RIM_M - 0.003), tuple(rng.uniform(lows[k % 3], highs[k % 3]).tolist())
        if math.hypot(*ball[:2]) < R_M and 0.0 < ball[2] < RIM_M:
            continue
        ways = ways_m(tie_m, ball)
        kinds.add(min(ways, key=lambda one: ways[one]))
        assert path_length_m(tie_m, ball) == pytest.approx(min(ways.values()), abs=1e-7)
    assert len(kinds) == 5


def test_round_the_wall_it_is_as_long_as_mujocos_tendon() -> None:
    mujoco = pytest.importorskip("mujoco", reason="mujoco (the extra 'mujoco') is not installed")
    model = mujoco.MjModel.from_xml_string(
        f"""<mujoco><worldbody><geom name="wall" type="cylinder" size="{R_M} 1"/>
        <site name="tie" pos="{R_M + 1e-9} 0 0.02"/>
        <body name="ball" mocap="true"><site name="ball"/></body><site name="aside" pos="0 0.2 0"/></worldbody>
        <tendon><spatial><site site="tie"/><geom geom="wall"/><site site="ball"/></spatial></tendon></mujoco>"""
    )
    data, rng, compared = mujoco.MjData(model), np.random.default_rng(0), 0
    while compared < 200:
        ball = (rng.uniform(-0.3, 0.04), rng.uniform(-0.3, 0.3), rng.uniform(-0.3, 0.3))
        touched = side_path(R_M, RIM_M, 0.02, ball)
        if math.hypot(*ball[:2]) < 1.02 * R_M or not 1e-6 < touched.z_m < RIM_M - 1e-6:
            continue  # its cylinder has no ends
        data.mocap_pos[0] = ball
        mujoco.mj_forward(model, data)
        assert data.ten_length[0] == pytest.approx(path_length_m(0.02, ball), abs=1e-7)
        compared += 1


@pytest.mark.parametrize("below_rim_m", [0.001, 0.069, 0.2])
def test_a_tie_outside_the_wall_is_refused(below_rim_m: float) -> None:
    tie = dataclasses.replace(GAME.cup.tie, below_rim_m=below_rim_m)  # type: ignore[arg-type]
    with pytest.raises(ConfigError, match=r"'tie.below_rim_m' is .*allowed: 0.002 to 0.068") as raised:
        dataclasses.replace(GAME.cup, tie=tie)
    assert "\n" not in str(raised.value)


def test_a_rope_shorter_than_the_way_into_the_mouth_is_refused() -> None:
    with pytest.raises(ConfigError, match=r"allowed: above 0\.104"):
        dataclasses.replace(GAME, rope=dataclasses.replace(GAME.rope, length_m=0.1))


def test_the_swing_up_refuses_a_tie_at_the_side() -> None:
    with pytest.raises(ConfigError, match=r"is side: .*choose game/cup=floor or handle") as raised:
        TautRope.of(GAME)
    assert "\n" not in str(raised.value)
    assert CupProfile.of(GAME.cup).side_m == pytest.approx(0.015)
