"""The search finds placements that hold on the arm in DART, the same every time, and says why where it finds none."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence

import numpy as np
import pytest

from kendama_cli.artifacts.motion_plan import MotionPlan
from kendama_cli.errors import StageError
from kendama_cli.motion.dmp.heading import CupPath, heading_turn, scaled_plan, turned_plan
from kendama_cli.motion.dmp.primitive import play
from kendama_cli.robot_model.arm_motion import ArmMotion
from kendama_cli.robot_model.chain import compiled_chain
from kendama_cli.robot_model.chain_kernel import clearance
from kendama_cli.robot_model.chain_kernel import efforts as chain_efforts
from kendama_cli.robot_model.inverse_kinematics import OutOfReachError, solve_cup
from kendama_cli.robot_model.model import RobotModel
from kendama_cli.robot_model.placement import find_placement as finding
from kendama_cli.robot_model.placement.clearance import collision_geometry_about, tool_of
from kendama_cli.robot_model.placement.evolution import Minimum
from kendama_cli.robot_model.placement.find_placement import (
    current_placement,
    find_placement,
    measured,
    min_tau_scale,
    require_workable,
)
from kendama_cli.robot_model.placement.motion_check import limit_ratios
from kendama_cli.robot_model.placement.placement_search import (
    IMPOSSIBLE,
    UNREACHED,
    Demand,
    PlacementProblem,
    line_demands,
    motion_demand,
)
from kendama_cli.schema.arrays import Array
from kendama_cli.settings.placement import LineSettings, Placement, placed
from tests.simulation.dart.bench_robot import bench_arm, kendama_game, modelled

GAME = kendama_game()
LEAD_IN = 5.0


def _quiet(done: int, total: int, cost: float) -> None:
    """Nobody watches."""


def _plan() -> MotionPlan:
    """A swing to the side and up, made up here."""
    count = 12
    centers = np.exp(-2.0 * np.linspace(0, 1, count))
    widths = np.append(-np.diff(centers), -np.diff(centers)[-1])
    swell = np.sin(np.linspace(0.0, np.pi, count)) ** 2  # begins and ends gently
    weights = swell * [200 * np.sin(np.linspace(0, 7, count)), 150 * np.cos(np.linspace(0, 9, count))]
    none, few = np.zeros(2), np.zeros((0, 1 + 2 * (3 + count)))
    return MotionPlan(("x", "z"), 2.0, 1.0, 300.0, 2.0, none, none, none, none, weights, centers, widths, few)


PLAN = _plan()


@pytest.fixture(scope="module")
def problem() -> PlacementProblem:
    path = CupPath(PLAN, LEAD_IN)
    return PlacementProblem(modelled(bench_arm()), GAME, [motion_demand(path.at(0.02 * np.arange(151)), 0.02)])


@pytest.fixture(scope="module")
def found() -> Placement:
    return find_placement(bench_arm(), GAME, PLAN, LEAD_IN, line=None, effort=0.15, progress=_quiet)


def test_the_swing_made_up_here_is_one() -> None:
    motion = play(PLAN, np.linspace(0.0, 2.0, 401))
    reach = np.ptp(motion.position_m, axis=0)
    assert (reach > 0.05).all()
    assert (reach < 0.6).all()


def test_the_given_placement_is_a_candidate_and_comes_back_as_it_was(problem: PlacementProblem) -> None:
    given = current_placement(modelled(bench_arm()))
    back = problem.placement(problem.place_of(given))
    for field in ("base_position_m", "home_rad", "handle_m"):
        assert getattr(back, field)[1:] == pytest.approx(getattr(given, field)[1:], abs=1e-4)
    cosine = float(np.dot(back.cup_axis, given.cup_axis) / np.linalg.norm(given.cup_axis))
    assert cosine == pytest.approx(1.0, abs=1e-4)
    ratio = np.array(back.redundancy_weights) / given.redundancy_weights
    assert np.ptp(ratio) / ratio.mean() < 1e-3  # their common factor means nothing


def test_every_candidate_holds_the_cup_upright_at_the_same_place(problem: PlacementProblem) -> None:
    rng = np.random.default_rng(5)
    for _ in range(10):
        placement = problem.placement(rng.uniform(size=problem.dimensions))
        arm = modelled(placed(bench_arm(), placement))
        value, _ = arm.cup_task(arm.home_rad)
        assert value == pytest.approx([0.0, 0.0, 1.2, 0.0, 0.0], abs=1e-5)
        digits = [*placement.base_position_m, *placement.home_rad, *placement.handle_m, placement.base_heading_rad]
        assert [round(one, 6) for one in digits] == digits, "a file is read by people"


def _cost_of_the_placed_arm(arm: RobotModel, demands: Sequence[Demand]) -> float:
    """The cost by the arm in DART, where it stands: path, limits and gaps by its own joints."""
    root, limits = arm.settings.base_position_m, arm.limits
    tie, start = arm.tool_position_m(arm.home_rad), arm.joint_positions_m(arm.home_rad)[-1]
    rise = (tie - start) / np.linalg.norm(tie - start)
    sides = [np.array([-math.sin(one.swing_rad), math.cos(one.swing_rad), 0.0]) for one in demands]
    blocked = max(0.0, -root[2]) + max(0.0, root[2] - 1.1) + max(0.0, *(0.5 - abs(rise @ side) for side in sides))
    blocked += max(0.0, -0.05 - rise[2]) + max(0.0, rise[2] - 0.6)
    if blocked > 0.5:
        return IMPOSSIBLE + blocked
    peak, chain = 0.0, compiled_chain(arm)
    for one, side in zip(demands, sides, strict=True):
        last, angles = arm.home_rad, []
        for position in one.path_m:
            try:
                last = solve_cup(arm, tie + position, last)
            except OutOfReachError:
                return UNREACHED
            angles.append(last)
        q = np.array(angles)
        slope, bend = (q[2:] - q[:-2]) / (2 * one.step), np.diff(q, 2, axis=0) / one.step**2
        v = one.velocity[1:-1, None]
        changes = [bend * v**2 + sign * slope * one.acceleration for sign in (1.0, -1.0)]
        tool = tool_of(arm, chain, GAME)
        efforts = [
            chain_efforts(chain, tool, q[k + 1], (slope * v)[k], way[k])
            for k in range(0, len(q) - 2, 3)
            for way in changes
        ]
        found = [np.abs(slope * v), np.abs(np.concatenate(changes)), np.abs(efforts)]
        speed, change, effort = (
            (kind.max(axis=0) / limit).max()
            for kind, limit in zip(
                found, (limits.velocity_rad_s, limits.acceleration_rad_s2, limits.effort_nm), strict=True
            )
        )
        peak = max(peak, one.weight * max(speed, one.rest_fraction * max(change, effort)))
        geometry = collision_geometry_about(arm, GAME, arm.settings.base_heading_rad, root[2], one.swing_rad)
        gap = clearance(chain, tool, geometry, q, 8)[0]
        assert heading_turn(arm.settings.base_heading_rad) @ geometry.side == pytest.approx(side, abs=1e-9)
        blocked += max(0.0, 0.05 - limits.to_stop_rad(q).min()) + 5.0 * max(0.0, 0.01 - gap)
    return peak + 5.0 * blocked


def test_the_cost_is_what_the_placed_arm_in_dart_needs_and_what_is_in_its_way() -> None:
    """Candidates about the shipped placement and far from it; a line in both directions, and a turned swing."""
    path = CupPath(turned_plan(PLAN, 0.3), LEAD_IN).at(0.02 * np.arange(151))
    demands = [motion_demand(path, 0.02, swing_rad=0.3), *line_demands(LineSettings(0.2, 1.0, 8.0), 0.35)]
    arm = modelled(bench_arm())
    problem, rng, kinds = PlacementProblem(arm, GAME, demands), np.random.default_rng(8), set()
    given = problem.place_of(current_placement(arm))
    for k in range(14):
        spread = (0.0, 0.03, 0.06, 0.3)[k % 4]
        place = np.clip(given + spread * rng.normal(size=problem.dimensions), 0.0, 1.0)
        cost = problem.cost(place)
        expected = _cost_of_the_placed_arm(modelled(placed(bench_arm(), problem.placement(place))), demands)
        kinds.add(expected // UNREACHED if expected >= UNREACHED else expected < 2)
        if expected == UNREACHED:
            assert UNREACHED <= cost < IMPOSSIBLE
        else:
            assert cost == pytest.approx(expected, rel=1e-3)
    assert kinds >= {True, IMPOSSIBLE // UNREACHED}


def test_the_search_beats_the_posture_in_the_middle_of_the_ranges_and_nothing_collides(found: Placement) -> None:
    motion = measured(placed(bench_arm(), found), GAME, PLAN, LEAD_IN)
    given = measured(bench_arm(), GAME, PLAN, LEAD_IN)
    assert motion.shares.leading[0].ratio < 1.0
    assert motion.shares.velocity.max() < 1.05 * given.shares.velocity.max()
    assert motion.clearance.gap_m > 0.0
    assert motion.shares.to_stop_rad.min() > 0.04
    assert motion.min_tau_scale < 1.0
    require_workable(bench_arm(), motion)


def test_the_fastest_tempo_keeps_efforts_too_and_no_tempo_carries_an_arm_that_is_too_weak() -> None:
    arm = modelled(bench_arm())
    swing = ArmMotion(arm, PLAN, LEAD_IN)
    needed = limit_ratios(arm, swing.joints(swing.min_tau_scale(), 0.0)).effort * arm.limits.effort_nm
    rest = np.abs(arm.rigid_effort_nm(arm.home_rad, np.zeros(7), np.zeros(7)))

    def fastest(effort_nm: Array) -> float:
        weak = dataclasses.replace(bench_arm(), effort_nm=tuple(effort_nm.tolist()))
        return min_tau_scale(ArmMotion(modelled(weak), PLAN, LEAD_IN))

    assert fastest(1.02 * needed) == pytest.approx(swing.min_tau_scale(), rel=0.01)
    weaker = fastest(0.9 * needed)
    assert weaker > 1.01 * swing.min_tau_scale()
    at_it = limit_ratios(arm, swing.joints(weaker, 0.0)).effort * arm.limits.effort_nm
    assert (at_it / (0.9 * needed)).max() == pytest.approx(1.0, abs=0.01)
    assert fastest(np.maximum(0.5 * rest, 1.0)) == math.inf


def test_the_same_search_finds_the_same_placement() -> None:
    one, other = (
        find_placement(bench_arm(), GAME, PLAN, LEAD_IN, line=None, effort=0.03, progress=_quiet) for _ in range(2)
    )
    assert one == other


def test_a_better_redundancy_or_a_longer_search_never_costs_more(problem: PlacementProblem, found: Placement) -> None:
    given = problem.cost(problem.place_of(current_placement(modelled(bench_arm()))))
    assert problem.cost(problem.place_of(found)) <= given


def test_a_line_asks_less_speed_near_its_ends() -> None:
    right, left = line_demands(LineSettings(0.4, 2.0, 8.0), 0.5)
    assert right.path_m[:, 0].max() == pytest.approx(0.42)
    assert (left.path_m == -right.path_m).all()
    assert right.velocity.max() == 2.0
    assert (np.diff(right.velocity) <= 0).all()
    out = 0.4 - right.path_m[:-1, 0]
    # what is left can be braked with nine tenths of the acceleration
    assert (right.velocity[:-1] ** 2 <= 2 * 7.2 * (out + 0.0201)).all()


def test_a_line_that_is_wider_and_faster_is_demanded_so(monkeypatch: pytest.MonkeyPatch) -> None:
    """Before, the search kept 0.43 m, 2 m/s and 14 m/s^2 in reach, whatever the settings said."""
    seen: list[Demand] = []

    def looked(problem: PlacementProblem, *_: object, **__: object) -> Minimum:
        seen.extend(problem.demands[1:])
        return Minimum(np.full(problem.dimensions, 0.5), 0.0)

    monkeypatch.setattr(finding, "search", looked)
    line = LineSettings(half_width_m=0.6, max_speed_m_s=3.0, acceleration_m_s2=20.0)
    find_placement(bench_arm(), GAME, PLAN, LEAD_IN, line=line, effort=0.1, progress=_quiet)
    assert [np.abs(one.path_m[:, 0]).max() for one in seen] == pytest.approx([0.62, 0.62])
    assert [(one.velocity.max(), one.acceleration) for one in seen] == [(3.0, 20.0)] * 2


def test_costs_of_what_cannot_be_are_far_above_those_of_what_can(problem: PlacementProblem) -> None:
    rng = np.random.default_rng(6)
    costs = np.array([problem.cost(rng.uniform(size=problem.dimensions)) for _ in range(300)])
    assert (costs >= IMPOSSIBLE).any()
    assert ((costs >= UNREACHED) & (costs < IMPOSSIBLE)).any()
    assert np.isfinite(costs).all()


def test_a_motion_outside_the_workspace_says_how_far_where_and_when() -> None:
    huge = scaled_plan(PLAN, 25.0, 1.0)
    message = r"leaves the workspace of pa10: at \d\.\d\d s, x .* m from its start, .* \d+\.\d+ m short"
    with pytest.raises(StageError, match=message) as raised:
        find_placement(bench_arm(), GAME, huge, LEAD_IN, line=None, effort=0.02, progress=_quiet)
    assert "\n" not in str(raised.value)


def test_a_motion_beyond_a_limit_names_joint_and_limit(found: Placement) -> None:
    arm = placed(bench_arm(), found)
    hasty = measured(arm, GAME, dataclasses.replace(PLAN, duration_s=0.4), LEAD_IN)
    with pytest.raises(StageError, match=r"pa10: .* needs [\d.]+ of joint '\w+' (speed|acceleration|effort) limit \("):
        require_workable(arm, hasty)


def test_links_that_overlap_are_named(found: Placement) -> None:
    thick = dataclasses.replace(placed(bench_arm(), found), link_radius_m=(0.3,) * 7)
    motion = measured(thick, GAME, PLAN, LEAD_IN)
    with pytest.raises(StageError, match=r"lets .* and .* overlap by \d+ mm"):
        require_workable(thick, motion)


def test_a_placed_arm_is_the_same_arm_elsewhere(found: Placement) -> None:
    arm = placed(bench_arm(), found)
    assert current_placement(modelled(arm)) == found
    assert (arm.path, arm.acceleration_rad_s2) == (bench_arm().path, bench_arm().acceleration_rad_s2)
    assert math.hypot(*arm.tool.cup_axis) == pytest.approx(1.0, abs=1e-5)
