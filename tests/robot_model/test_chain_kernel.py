"""The compiled chain beside plain numpy and scipy, on random chains."""

from __future__ import annotations

import itertools
from collections.abc import Iterator

import numpy as np
import pytest
from scipy.optimize import lsq_linear

from kendama_cli.robot_model.chain_kernel import (
    DAMPING,
    Chain,
    CollisionGeometry,
    Curve,
    IkSettings,
    ToolGeometry,
    apart,
    clearance,
    efforts,
    follow,
    frames,
    least_step,
    peaks,
    solved,
    task,
)
from kendama_cli.schema.arrays import Array
from tests.robot_model.random_chain import bias, inertia, jacobian, poses, random_chain

TOOL = ToolGeometry(np.array([0.3, -0.2, 0.4]), np.array([0.6, 0.0, 0.8]), 0.7)


@pytest.mark.parametrize("seed", range(6))
def test_efforts_are_those_of_lagrange_with_a_held_mass_rotors_and_friction(seed: int) -> None:
    rng = np.random.default_rng(seed)
    chain, n = random_chain(rng), 4
    angles, speeds, changes = rng.normal(0, [[2.0], [0.5], [5.0]], (3, n))
    speeds[rng.integers(n)] = 0.0
    held = chain._replace(  # a point mass, as another link on a joint that does not turn
        axes=np.vstack([chain.axes, [1.0, 0.0, 0.0]]),
        origins=np.vstack([chain.origins, np.zeros(3)]),
        mass_kg=np.append(chain.mass_kg, TOOL.mass_kg),
        centers_m=np.vstack([chain.centers_m, TOOL.tie_m]),
        inertia_kg_m2=np.concatenate([chain.inertia_kg_m2, np.zeros((1, 3, 3))]),
    )
    state = np.append(angles, 0.0), np.append(speeds, 0.0)
    rigid = (inertia(held, state[0]) @ np.append(changes, 0.0) + bias(held, *state))[:n]
    dry = chain.coulomb_nm + chain.stribeck_nm * np.exp(-((speeds / chain.stribeck_rad_s) ** 2))
    friction = chain.viscous_nm_s * speeds + dry * np.sign(speeds)
    expected = rigid + chain.rotor_kg_m2 * changes + friction
    assert efforts(chain, TOOL, angles, speeds, changes) == pytest.approx(expected, rel=1e-7, abs=1e-7)


@pytest.mark.parametrize("seed", range(6))
def test_the_task_is_the_tie_point_and_the_turn_that_is_missing_to_upright(seed: int) -> None:
    rng = np.random.default_rng(seed)
    chain, angles = random_chain(rng), rng.normal(0, 2, 4)
    rotations, shifts, found = np.empty((5, 3, 3)), np.empty((5, 3)), np.empty((5, 4))
    frames(chain, angles, rotations, shifts)
    for one, (rotation, shift) in zip(range(5), poses(chain, angles), strict=True):
        assert rotations[one] == pytest.approx(rotation, abs=1e-12)
        assert shifts[one] == pytest.approx(shift, abs=1e-12)
    value = task(chain, TOOL, rotations, shifts, found)
    rotation, shift = poses(chain, angles)[-1]
    up = rotation @ TOOL.axis
    turn = np.cross(up, [0.0, 0.0, 1.0])[:2]  # about x and y, its sine; beyond the horizontal its direction
    assert value[:3] == pytest.approx(rotation @ TOOL.tie_m + shift, abs=1e-12)
    assert value[3:] == pytest.approx(turn if up[2] >= 0 else turn / np.linalg.norm(turn), abs=1e-12)
    linear, angular = jacobian(chain, angles, TOOL.tie_m, 4)
    assert found == pytest.approx(np.vstack([linear, angular[:2]]), abs=1e-12)


def test_a_system_is_solved_by_its_lower_triangle_and_its_damping_is_a_fraction_of_its_trace() -> None:
    rng = np.random.default_rng(1)
    for size in (1, 3, 5):
        square = rng.normal(size=(size, size))
        square, side = square @ square.T + np.eye(size), rng.normal(size=size)
        damped = square + DAMPING * np.trace(square) / size * np.eye(size)
        lower = np.tril(square) + np.triu(np.full((size, size), np.nan), 1)
        assert solved(lower, side) == pytest.approx(np.linalg.solve(damped, side), rel=1e-12)


def test_a_step_is_the_least_weighted_one_that_makes_the_change() -> None:
    rng = np.random.default_rng(2)
    for _ in range(20):
        matrix, change, weights = rng.normal(size=(5, 7)), rng.normal(size=5), rng.uniform(0.1, 5.0, 7)
        root = np.sqrt(weights)
        expected = np.linalg.pinv(matrix / root) @ change / root
        assert least_step(matrix, change, weights) == pytest.approx(expected, rel=1e-5, abs=1e-6)


@pytest.mark.parametrize("acceleration", [0.0, 3.0])
def test_peaks_are_those_of_the_differences_along_the_curve(acceleration: float) -> None:
    rng = np.random.default_rng(3)
    chain, step, count = random_chain(rng), 0.1, 14
    for _ in range(5):
        angles, velocity = rng.normal(0, 0.1, (count, 4)), rng.uniform(0.5, 2.0, count)
        found = peaks(chain, TOOL, Curve(angles, step, velocity, acceleration))
        slope = (angles[2:] - angles[:-2]) / (2 * step)
        bend = np.diff(angles, 2, axis=0) / step**2 * velocity[1:-1, None] ** 2
        speeds = slope * velocity[1:-1, None]
        changes = np.array([bend + slope * acceleration, bend - slope * acceleration])
        rows = range(0, count - 2, 3)  # every third sample from the second on
        torques = [efforts(chain, TOOL, angles[k + 1], speeds[k], way[k]) for k in rows for way in changes]
        for one, expected in zip(found, (speeds, changes.reshape(-1, 4), np.array(torques)), strict=True):
            assert one == pytest.approx(np.abs(expected).max(axis=0), rel=1e-12)


def test_along_a_path_every_place_is_reached_upright_or_told_as_missed() -> None:
    rng = np.random.default_rng(9)
    chain = random_chain(rng, 7)
    ik = IkSettings(rng.normal(0, 1, 7), rng.uniform(0.5, 2, 7))
    rotation, shift = poses(chain, ik.home)[-1]
    tool = TOOL._replace(axis=rotation.T @ [0.0, 0.0, 1.0])
    start = rotation @ tool.tie_m + shift
    path = np.linspace(0.0, 0.3, 16)[:, None] * [0.6, -0.5, 0.4]
    angles, missed = follow(chain, tool, ik, path, False)
    for one, position in zip(angles, path, strict=True):
        rotation, shift = poses(chain, one)[-1]
        assert rotation @ tool.tie_m + shift == pytest.approx(start + position, abs=1e-7)
        assert (rotation @ tool.axis)[:2] == pytest.approx([0.0, 0.0], abs=1e-7)
    assert missed.max() < 1e-8
    for before, after, way in zip(angles, angles[1:], np.diff(path, axis=0), strict=False):
        linear, angular = jacobian(chain, before, tool.tie_m, 7)
        step = least_step(np.vstack([linear, angular[:2]]), np.append(way, [0.0, 0.0]), ik.weights)
        assert after - before == pytest.approx(step, abs=0.02 * np.abs(step).max() + 1e-3)


def _between(a: Array, b: Array, c: Array, d: Array) -> float:
    """Return the distance of two segments as a bounded least-squares problem."""
    found = lsq_linear(np.column_stack([b - a, c - d]), c - a, (0.0, 1.0), method="bvls", tol=1e-14)
    return float(np.sqrt(2 * found.cost))


def test_the_distance_of_segments_is_a_bounded_least_squares_problem() -> None:
    rng = np.random.default_rng(3)
    for scale in (0.1, 1.0, 4.0):
        for _ in range(60):
            a, b, c, d = scale * rng.normal(size=(4, 3)) + rng.normal(size=(4, 3))
            assert apart(a, b, c, d) == pytest.approx(_between(a, b, c, d), abs=1e-7)
            assert apart(a, b, c, c) == pytest.approx(_between(a, b, c, c), abs=1e-7)
            assert apart(a, a, c, d) == pytest.approx(_between(a, a, c, d), abs=1e-7)
            assert apart(a, a, c, c) == pytest.approx(np.linalg.norm(a - c))
            assert apart(a, b, d, d + 3 * (b - a)) == pytest.approx(_between(a, b, d, d + 3 * (b - a)), abs=1e-7)


def test_the_least_gap_is_that_of_all_pairs_of_parts_along_the_motion() -> None:
    rng = np.random.default_rng(4)
    seen = set()
    for _ in range(40):
        n = 5
        chain = random_chain(rng, n)
        chain = chain._replace(origins=np.cumsum(rng.normal(0, 0.5, (n, 3)), axis=0))
        chain = chain._replace(tip_m=chain.origins[-1] + rng.normal(0, 0.3, 3))
        tool = TOOL._replace(tie_m=chain.tip_m + rng.normal(0, 0.3, 3))
        side = rng.normal(size=3)
        geometry = CollisionGeometry(
            rng.uniform(0.02, 0.15, n + 2), rng.uniform(-3.0, -0.5), side / np.linalg.norm(side),
            rng.choice([-1e3, 0.3]), 0.03, rng.uniform(0.04, 0.3),
        )  # fmt: skip
        angles, every = rng.normal(0, 1, (3, n)), int(rng.integers(1, 3))
        gaps = [(*gap, k) for k in range(0, 3, every) for gap in _gaps(chain, tool, geometry, angles[k])]
        found = clearance(chain, tool, geometry, angles, every)
        assert found[0] == pytest.approx(min(gaps)[0], abs=1e-9)
        assert found[1:] in [one[1:] for one in gaps if one[0] < found[0] + 1e-9]  # of one link they are equal
        seen.add("floor" if found[1] < 0 else {n + 2: "cup", n + 3: "swing"}.get(found[2], "parts"))
    assert seen == {"floor", "cup", "swing", "parts"}


def _gaps(
    chain: Chain, tool: ToolGeometry, geometry: CollisionGeometry, angles: Array
) -> Iterator[tuple[float, int, int]]:
    """Yield the gap of each pair of parts that is compared at ``angles``, and the pair."""
    at, n = poses(chain, angles), len(angles)
    joints = [rotation @ origin + shift for (rotation, shift), origin in zip(at, chain.origins, strict=False)]
    tip, tie = (at[n][0] @ point + at[n][1] for point in (chain.tip_m, tool.tie_m))
    foot = np.append(joints[0][:2], min(geometry.floor_m, joints[0][2]))
    points = [foot, *joints, tip, tie]
    wide = geometry.radius_m
    way = np.append(0.0, np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1)))
    for one, two in itertools.combinations(range(n + 2), 2):  # from the end of one to the begin of the other
        if way[two] - way[one + 1] > 1.2 * (wide[one] + wide[two]):
            yield _between(*points[one : one + 2], *points[two : two + 2]) - wide[one] - wide[two], one, two
    for one in range(n + 2):
        start, end = points[one : one + 2]
        if one >= 2:  # neither the pedestal nor the link on it
            yield min(start[2], end[2]) - geometry.floor_m - wide[one], -1, one
        if one <= n and way[n + 2] - way[one + 1] > 1.2 * (wide[one] + geometry.cup_m):
            yield _between(start, end, tie, tie) - wide[one] - geometry.cup_m, one, n + 2
        for fraction in np.linspace(0.0, 0.7 if one == n + 1 else 1.0, 8):
            away = start + fraction * (end - start) - tie
            flat = away - away @ geometry.side * geometry.side
            disc = flat * min(1.0, geometry.swing_m / np.linalg.norm(flat))
            yield np.linalg.norm(away - disc) - wide[one] - geometry.ball_m, one, n + 3
