"""Size of a game that an arm can play where the game as it is asks too much of it."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from kendama_cli.artifacts.motion_plan import MotionPlan
from kendama_cli.errors import StageError
from kendama_cli.motion.dmp.heading import scaled_plan
from kendama_cli.robot_model.placement.find_placement import PlacedMotion, find_placement, measured
from kendama_cli.settings.game import GameSettings
from kendama_cli.settings.placement import placed
from kendama_cli.settings.robot import RobotSettings

SIZES = (0.9, 0.8, 0.7, 0.6, 0.5, 0.4, 0.3, 0.2)
SPARE = 0.25
"""Fraction of the tempos that the search for the catch keeps: with 0.20 SO-101 caught nothing, with 0.45 it did."""
SEARCH_SHARE = 0.3
"""Effort of the search at each size, beside that at the game's own."""


@dataclass(frozen=True)
class SmallerGame:
    """The ``game`` and its ``motion`` at ``size`` times the lengths; tau is sqrt(size) times that of the whole game."""

    size: float
    game: GameSettings
    motion: PlacedMotion


def find_smaller_game(
    robot: RobotSettings,
    game: GameSettings,
    plan: MotionPlan,
    lead_in_m_s2: float,
    slowest_tau: float,
    *,
    effort: float,
    progress: Callable[[float], None],
) -> SmallerGame | None:
    """Return the largest similar game of SIZES that ``robot`` can play, else that which asks least of its limits.

    Swing, rope, ball and cup shrink together, and tau by sqrt(size) (see similar_game): what catches in the whole game
    then catches in the smaller one. A size counts where the limits leave SPARE of the way from the motion's own tau to
    ``slowest_tau`` to the search for the catch. ``progress`` is called with each size.
    Returns None where the arm reaches none of them.
    """
    best: SmallerGame | None = None
    own = plan.tau_scale
    from_tau = own * (max(own, slowest_tau) / own) ** (1.0 - SPARE)
    for size in SIZES:
        progress(size)
        tempo, small = math.sqrt(size), similar_game(game, size)
        swing = scaled_plan(plan, size, tempo * plan.tau_scale)
        try:
            found = find_placement(
                robot, small, swing, lead_in_m_s2, line=None, effort=SEARCH_SHARE * effort, progress=lambda *_: None
            )
            motion = measured(placed(robot, found), small, swing, lead_in_m_s2, tempo * from_tau)
        except StageError:  # out of reach
            continue
        one = SmallerGame(size, small, motion)
        if motion.workable:
            return one
        if best is None or motion.shares.leading[0].ratio < best.motion.shares.leading[0].ratio:
            best = one
    return best


POWERS = {
    "length_m": 1.0,
    "radius_m": 1.0,
    "depth_m": 1.0,
    "wall_m": 1.0,
    "below_rim_m": 1.0,
    "string_diameter_m": 1.0,
    "mass_kg": 3.0,
    "stiffness_n_m": 2.0,
    "damping_n_s_m": 2.5,
    "drag_n_s_m": 2.5,
    "linear_n_s_m": 2.5,
    "quadratic_n_s2_m2": 2.0,
}
"""Powers of the size with which the fields of a game grow; the others are numbers without a unit, angles, density."""


def similar_game(game: GameSettings, size: float) -> GameSettings:
    """Return ``game`` with lengths ``size`` times as long, of the same materials.

    Gravity g stays, so that times grow by sqrt(size) and accelerations stay (Froude's similarity: v^2 / (g l) is the
    same). Masses and so all forces grow by size^3; a force that grows with length, speed or speed squared has a
    coefficient that grows by size^2, size^2.5 or size^2.
    """
    made: GameSettings = _scaled(game, size)
    return made


def _scaled(part: Any, size: float) -> Any:
    """Return a dataclass with its fields of POWERS, and those of dataclasses in it, scaled."""
    changed: dict[str, Any] = {}
    for field in dataclasses.fields(part):
        value = getattr(part, field.name)
        if dataclasses.is_dataclass(value):
            changed[field.name] = _scaled(value, size)
        elif field.name in POWERS:
            changed[field.name] = value * size ** POWERS[field.name]
    return dataclasses.replace(part, **changed)
