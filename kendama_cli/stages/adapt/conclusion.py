"""What adapt gives in the end: the chosen motion, played once more undisturbed, and what is told of the search."""

from __future__ import annotations

import dataclasses
import math

import numpy as np

from kendama_cli.adaptation.catch_obstacle import TORQUE_SPENT, obstacle, policy_obstacle
from kendama_cli.adaptation.catch_search import nearest_attempt, windows
from kendama_cli.adaptation.search_record import Attempt, Bounds, CatchSearch, MotionVariation, Search
from kendama_cli.adaptation.settings import AdaptSettings
from kendama_cli.artifacts.motion_plan import CatchMotion
from kendama_cli.artifacts.proportion import success_interval
from kendama_cli.errors import StageError
from kendama_cli.motion.dmp.heading import heading_turn, turned_plan
from kendama_cli.robot_model.model import RobotModel
from kendama_cli.robot_model.placement.find_placement import current_placement
from kendama_cli.simulation.dart.rollout import RolloutResult
from kendama_cli.stages.adapt.logged import log_chosen, log_windows, turned_trace
from kendama_cli.stages.adapt.rollouts import Rollouts
from kendama_cli.stages.adapt.trials import attempt_made
from kendama_cli.stages.interface import Made, Metric, StageContext

NOT_REPEATED = (
    "no rollout of the search was caught, so none was repeated: there is no success_rate, and 'caught' is one "
    "undisturbed rollout of the nearest"
)


def conclude(
    rollouts: Rollouts,
    search: Search,
    way: CatchSearch,
    *,
    settings: AdaptSettings,
    bounds: Bounds,
    eyes_seed: int,
    ctx: StageContext,
) -> Made:
    """The best motion that ``way`` found, or the nearest to a catch; it is logged, and the search's figures told.

    Raises StageError where everything that catches lacks the reach that is asked for.
    """
    best, family = way.best(search), rollouts.family
    variation = best or _best_short_of_reach(search, way) or nearest_attempt(search).variation
    swing, heading_rad = family.swing(variation), rollouts.standing.heading_rad
    arm = RobotModel(rollouts.standing.robot, rollouts.game.cup, rollouts.game.gravity_m_s2)
    result, _ = rollouts.judged(variation, None, eyes_seed=eyes_seed, record=True)
    if result.trace is not None:
        reference_m = swing.cup_reference_m(variation.tau_scale, result.trace.t_s) @ heading_turn(-heading_rad)
        log_chosen(ctx, arm, rollouts.game, turned_trace(result.trace, heading_rad), reference_m)
    of_search = _of_search(search, best, way, settings=settings, bounds=bounds, ctx=ctx)
    if best is None and search.short_of_reach:
        raise _refused(search, variation, way)
    metrics: dict[str, Metric] = {"caught": result.caught, "caught_later": result.caught_later}
    if not result.caught:
        chosen = attempt_made(variation, swing, result)
        policy = settings.search != "tau"
        metrics["failure_reason"] = (
            policy_obstacle(chosen, search) if policy else _obstacle(rollouts, chosen, settings, bounds, result)
        )
    rate = _rate(search)
    metrics |= {
        "tau_scale": variation.tau_scale,
        "rollouts": way.rollouts(search),
        "catch": settings.catch,
        "uncertainty": settings.uncertainty.name,
        **rate,
        "search": settings.search,
        "rollouts_to_robust": way.rollouts(search) if _lasts(search, settings) else None,
        **of_search,
        "rollouts_to_first_catch": search.rollouts_to_first_catch(),
        "heading_deg": math.degrees(heading_rad),
        "amplitude": variation.amplitude,
        "goal_shift_mm": 1e3 * float(np.hypot(*variation.shift_m)),
        "signed_miss_mm": None if result.signed_miss_m is None else 1e3 * result.signed_miss_m,
        "lateral_miss_mm": None if result.side_miss_m is None else 1e3 * result.side_miss_m,
        "swing_slack_ms": 1e3 * result.swing_slack_s,
        "apex_mm": 1e3 * result.apex_m,
        "planned_speed_over_limit": float(swing.velocity_shares.max() / variation.tau_scale),
        "speed_over_limit": result.velocity_share,
        "effort_over_limit": result.effort_share,
    }
    joints = swing.joints(variation.tau_scale, settings.hold_s)
    plan = turned_plan(family.plan(variation), heading_rad)
    flight_s = None if result.flight_s is None else result.flight_s[0]
    motion = CatchMotion(plan, joints, current_placement(arm), result.caught, rate["success_rate"], flight_s)
    return Made(motion, metrics, () if search.confirmed else (NOT_REPEATED,))


def _rate(search: Search) -> dict[str, float | None]:
    successes, repeats = sum(repeat.caught for repeat in search.confirmed), len(search.confirmed)
    if not repeats:
        return {"success_rate": None, "success_rate_low": None, "success_rate_high": None}
    interval = success_interval(successes, repeats)
    return {"success_rate": successes / repeats, "success_rate_low": interval.low, "success_rate_high": interval.high}


def _lasts(search: Search, settings: AdaptSettings) -> bool:
    """Whether enough repeats were caught: those that ended a policy search, or those that confirm."""
    enough, of = settings.policy.stop_at
    judged = [search.confirmed] if settings.search == "tau" else [made for _, made in search.evaluated]
    return any(len(made) >= of and sum(one.caught for one in made) * of >= enough * len(made) for made in judged)


def _refused(search: Search, best: MotionVariation, way: CatchSearch) -> StageError:
    """Return the refusal of a search that found only catches without reach, of which ``best`` is worth most."""
    return StageError(
        f"no motion that catches leaves a seen catch its reach: at tau_scale {best.tau_scale:.4g}, the best of them "
        f"with an expected success of {way.expected(search, best):.2f}, {dict(search.short_of_reach)[best]}"
    )


def _best_short_of_reach(search: Search, way: CatchSearch) -> MotionVariation | None:
    """The catch without the reach that is asked for that would be worth most; None where there is none."""
    if not search.short_of_reach:
        return None
    return way.best(dataclasses.replace(search, short_of_reach=())) or search.short_of_reach[-1][0]


def _of_search(
    search: Search,
    best: MotionVariation | None,
    way: CatchSearch,
    *,
    settings: AdaptSettings,
    bounds: Bounds,
    ctx: StageContext,
) -> dict[str, Metric]:
    """What only the search that was made can tell."""
    if settings.search != "tau":
        return {"evaluations": sum(len(made) for _, made in search.evaluated)}
    found = windows(search, settings, bounds)
    log_windows(ctx, found, search)
    return {
        "predicted_success": None if best is None else way.expected(search, best),
        "tau_windows": len(found),
    }


def _obstacle(
    rollouts: Rollouts, chosen: Attempt, settings: AdaptSettings, bounds: Bounds, result: RolloutResult
) -> str:
    torque = f"joint '{result.effort_joint}'" if result.effort_share >= TORQUE_SPENT else None
    limiting = rollouts.family.swing(MotionVariation(1.0, chosen.variation.amplitude)).limiting_joint()
    return obstacle(chosen, settings, bounds, limiting, torque)
