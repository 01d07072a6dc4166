"""A placement for one motion: searched on the compiled chain, then measured on the arm in DART."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from kendama_cli.artifacts.motion_plan import MotionPlan
from kendama_cli.errors import StageError
from kendama_cli.motion.dmp.heading import CupPath, swing_heading_rad
from kendama_cli.robot_model.arm_motion import ArmMotion
from kendama_cli.robot_model.model import RobotModel
from kendama_cli.robot_model.placement.clearance import Clearance, min_clearance
from kendama_cli.robot_model.placement.motion_check import LimitRatios, limit_ratios
from kendama_cli.robot_model.placement.placement_search import (
    UNREACHED,
    PlacementProblem,
    line_demands,
    motion_demand,
    search,
)
from kendama_cli.schema.arrays import Array
from kendama_cli.settings.game import GameSettings
from kendama_cli.settings.placement import LineSettings, Placement
from kendama_cli.settings.robot import RobotSettings

SEED = 1
"""Of the search's own random numbers: one motion and one arm have one placement, whatever the run's seed."""
SAMPLE_S = 0.02
LINE_WEIGHT = 0.35
"""The line of the swing-up and the catch may need all of the limits where the motion needs this fraction of them."""
WORKABLE, ROUNDING = 1.0, 1e-6
SLOWEST, TAU_RESOLUTION = 8.0, 0.005
"""A motion so many times slower needs the efforts of rest, and how finely the minimum tau_scale is searched."""


@dataclass(frozen=True)
class PlacedMotion:
    """Demand of a motion on an arm at a placement: ratios of its limits, clearance, and the fastest tau."""

    placement: Placement
    shares: LimitRatios
    clearance: Clearance
    min_tau_scale: float
    """within all limits; infinite where the arm cannot even rest"""
    tau_scale: float
    """at which the shares are"""

    @property
    def workable(self) -> bool:
        """True if the motion keeps all limits and nothing collides."""
        return self.clearance.gap_m >= 0 and self.shares.leading[0].ratio <= WORKABLE


def current_placement(arm: RobotModel) -> Placement:
    """Return the present placement of ``arm`` and its grip of the cup."""
    tool = arm.settings.tool
    return Placement(
        base_position_m=arm.settings.base_position_m,
        base_heading_rad=arm.settings.base_heading_rad,
        home_rad=tuple(arm.home_rad.tolist()),
        handle_m=tool.handle_m,
        cup_axis=tool.cup_axis,
        redundancy_weights=tuple(arm.redundancy_weights.tolist()),
    )


def find_placement(
    robot: RobotSettings,
    game: GameSettings,
    plan: MotionPlan,
    lead_in_m_s2: float,
    *,
    line: LineSettings | None,
    effort: float,
    progress: Callable[[int, int, float], None],
) -> Placement:
    """Return the placement of ``robot`` in which ``plan``, at its own tau, needs the minimum ratio of the limits.

    With a ``line`` it also keeps that within reach, on which the swing-up is learned and the ball caught. ``effort``
    scales the time that is spent; the same call finds the same placement. ``progress`` is called with starts done,
    starts in all and the least cost so far (the maximum fraction of a speed limit, or 0.6 of that of an acceleration or
    effort limit). Raises StageError where the motion leaves the workspace, saying where and how far.
    """
    path = CupPath(plan, lead_in_m_s2)
    path_m = path.at(SAMPLE_S * np.arange(int(np.ceil(path.duration_s / SAMPLE_S)) + 1, dtype=np.float64))
    demands = [motion_demand(path_m, SAMPLE_S * plan.tau_scale, swing_rad=swing_heading_rad(plan))]
    if line is not None:
        demands += line_demands(line, LINE_WEIGHT)
    arm = RobotModel(robot, game.cup, game.gravity_m_s2)
    problem = PlacementProblem(arm, game, demands)
    best = search(problem, current_placement(arm), rng=np.random.default_rng(SEED), effort=effort, progress=progress)
    if best.value >= UNREACHED:
        raise StageError(_out_of_reach(robot.called, problem, best.place))
    return problem.placement(best.place)


def measured(
    robot: RobotSettings, game: GameSettings, plan: MotionPlan, lead_in_m_s2: float, slowest_tau: float = 0.0
) -> PlacedMotion:
    """Return the demand of ``plan`` on ``robot`` at its placement, at its own tau or slowed to the limits.

    No slower than ``slowest_tau``. Raises StageError where the arm cannot follow.
    """
    arm = RobotModel(robot, game.cup, game.gravity_m_s2)
    swing = ArmMotion(arm, plan, lead_in_m_s2)
    minimum = min_tau_scale(swing)
    tau = max(plan.tau_scale, min(minimum, slowest_tau))
    joints = swing.joints(tau, 0.0)
    clear = min_clearance(arm, game, joints, swing_rad=swing_heading_rad(plan))
    return PlacedMotion(current_placement(arm), limit_ratios(arm, joints), clear, minimum, tau)


def min_tau_scale(swing: ArmMotion) -> float:
    """Return the minimum tau_scale within the limits of velocity, acceleration and effort.

    It is infinite where the effort of a motion SLOWEST times slower, which is that of the arm's weight, is too much.
    """

    def ratio(tau: float) -> float:
        return limit_ratios(swing.arm, swing.joints(tau, 0.0)).leading[0].ratio

    low, high = swing.min_tau_scale(), SLOWEST * max(swing.min_tau_scale(), 1.0)
    if ratio(low) <= WORKABLE + ROUNDING:
        return low
    if ratio(high) > WORKABLE:
        return math.inf
    while high / low > 1.0 + TAU_RESOLUTION:
        middle = math.sqrt(low * high)
        low, high = (low, middle) if ratio(middle) <= WORKABLE else (middle, high)
    return high


def require_workable(robot: RobotSettings, motion: PlacedMotion, remedy: str = "") -> None:
    """Raise StageError, naming the obstacle, where the motion is beyond a limit or something collides."""
    if motion.workable:
        return
    if motion.clearance.gap_m < 0:
        obstacle = f"lets {motion.clearance.parts} overlap by {-1e3 * motion.clearance.gap_m:.0f} mm"
        otherwise = "make the motion smaller (adapt.swing_scale), or robot.link_radius_m if it is too wide"
    else:
        obstacle = f"needs {motion.shares.leading[0]}"
        otherwise = (
            "play the motion slower (adapt.tau_range), make it smaller (adapt.swing_scale), or choose another robot"
        )
    raise StageError(f"{robot.called}: the best placement found {obstacle}: {remedy or otherwise}")


def _out_of_reach(name: str, problem: PlacementProblem, place: Array) -> str:
    missed = problem.unreached(place)
    if missed is None:
        return f"no placement of {name} was found in which it can hold the cup upright: choose another robot"
    demand, sample, off = missed
    x, y, z = np.round(demand.path_m[sample], 3).tolist()
    return (
        f"the motion leaves the workspace of {name}: at {sample * demand.step:.2f} s, x {x}, y {y}, z {z} m from its "
        f"start, the best placement found is {off:.3f} m short with the cup upright: make the motion smaller or "
        "choose a longer arm"
    )
