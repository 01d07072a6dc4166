"""Result of adapt: the chosen motion, once more undisturbed, the search's figures, and the reason for a miss."""

from __future__ import annotations

import dataclasses
import math

import numpy as np

from kendama_cli.adaptation.catch_family import attempt_of
from kendama_cli.adaptation.catch_search import MIN_APEX_M, TauSearch, nearest_attempt
from kendama_cli.adaptation.search_record import Attempt, Bounds, CatchSearch, MotionVariation, Search
from kendama_cli.adaptation.settings import AdaptSettings
from kendama_cli.artifacts.motion_plan import CatchMotion
from kendama_cli.errors import StageError
from kendama_cli.motion.dmp.heading import turned_plan
from kendama_cli.robot_model.model import RobotModel
from kendama_cli.robot_model.placement.find_placement import current_placement
from kendama_cli.simulation.dart.rollout import RolloutResult
from kendama_cli.stages.adapt.logged import log_chosen, log_windows
from kendama_cli.stages.adapt.trials import Trials
from kendama_cli.stages.interface import Metric, StageContext, StageResult

NOT_REPEATED = (
    "no rollout of the search was caught, so none was repeated: there is no success_rate, and 'caught' is one "
    "undisturbed rollout of the nearest"
)


def conclude(
    trials: Trials,
    search: Search,
    method: CatchSearch,
    *,
    settings: AdaptSettings,
    bounds: Bounds,
    arm: RobotModel,
    heading_rad: float,
    ctx: StageContext,
) -> StageResult:
    """Return the best motion that ``method`` found, or the nearest to a catch; log it and the search's windows.

    ``arm`` stands where the swing goes along ``heading_rad``. Raises StageError if everything that catches lacks the
    reach that is asked for.
    """
    best, family, game = method.best(search), trials.family, trials.world.ball.game
    variation = best or _best_short_of_reach(search, method) or nearest_attempt(search).variation
    swing = family.swing(variation)
    result, _ = trials.simulate(variation, search.simulations.undisturbed(), record=True)
    if result.trace is not None:
        reference_m = swing.cup_reference_m(variation.tau_scale, result.trace.t_s)
        log_chosen(ctx, arm, game, result.trace, reference_m=reference_m, heading_rad=heading_rad)
    of_search = _of_search(search, best, method, ctx)
    if best is None and search.short_of_reach:
        raise _refused(search, variation, method)
    metrics: dict[str, Metric] = {"caught": result.caught, "caught_later": result.caught_later}
    if not result.caught:
        chosen = attempt_of(variation, swing, result)
        policy = settings.search != "tau"
        metrics["failure_reason"] = (
            policy_obstacle(chosen, search) if policy else _obstacle(trials, chosen, settings, bounds, result)
        )
    rate = _rate(search, settings)
    metrics |= {
        "tau_scale": variation.tau_scale,
        "rollouts": method.rollouts(search),
        "catch": settings.catch,
        "uncertainty": settings.uncertainty.name,
        **rate,
        "search": settings.search,
        "rollouts_to_robust": method.rollouts(search) if _is_robust(search, settings) else None,
        **of_search,
        "rollouts_to_first_catch": search.rollouts_to_first_catch(),
        "heading_deg": math.degrees(heading_rad),
        "amplitude": variation.amplitude,
        "goal_shift_mm": 1e3 * float(np.hypot(*variation.shift_m)),
        "signed_miss_mm": None if result.signed_miss_m is None else 1e3 * result.signed_miss_m,
        "lateral_miss_mm": None if result.side_miss_m is None else 1e3 * result.side_miss_m,
        "swing_slack_ms": 1e3 * result.swing_slack_s,
        "apex_mm": 1e3 * result.apex_m,
        "planned_speed_over_limit": float(swing.velocity_ratios.max() / variation.tau_scale),
        "speed_over_limit": result.velocity_ratio,
        "effort_over_limit": result.effort_ratio,
    }
    joints = swing.joints(variation.tau_scale, settings.hold_s)
    plan = turned_plan(family.plan(variation), heading_rad)
    flight_s = None if result.flight_s is None else result.flight_s[0]
    motion = CatchMotion(plan, joints, current_placement(arm), result.caught, rate["success_rate"], flight_s)
    return StageResult(motion, metrics, () if search.simulations.confirmed else (NOT_REPEATED,))


def _of_search(
    search: Search, best: MotionVariation | None, method: CatchSearch, ctx: StageContext
) -> dict[str, Metric]:
    """Return the figures that only the search that was made has; log the windows of a search over tau."""
    if not isinstance(method, TauSearch):
        return {"evaluations": sum(len(made) for _, made in search.simulations.evaluated)}
    windows = method.windows(search)
    log_windows(ctx, windows, search)
    return {"predicted_success": None if best is None else method.expected(search, best), "tau_windows": len(windows)}


def _rate(search: Search, settings: AdaptSettings) -> dict[str, float | None]:
    confirmed = search.simulations.confirmed
    rate = settings.evaluation.figures("success_rate", sum(one.caught for one in confirmed), len(confirmed))
    return {"repeats": len(confirmed), **rate}


def _is_robust(search: Search, settings: AdaptSettings) -> bool:
    """Return True if enough repeats were caught: those that ended a policy search, or those that confirm.

    Repeats that confirm count too where they ended early.
    """
    enough, of = settings.policy.stop_at
    series, fewest = [made for _, made in search.simulations.evaluated], of
    if settings.search in {"tau", "aim"}:
        confirmed = search.simulations.confirmed
        series, fewest = [confirmed], of if len(confirmed) == settings.repeats else 1
    return any(len(made) >= fewest and sum(one.caught for one in made) * of >= enough * len(made) for made in series)


def _refused(search: Search, best: MotionVariation, method: CatchSearch) -> StageError:
    """Return the refusal of a search that found only catches without reach, of which ``best`` is worth most."""
    return StageError(
        f"no motion that catches leaves a visual catch its reach: at tau_scale {best.tau_scale:.4g}, the best of them "
        f"with an expected success of {method.expected(search, best):.2f}, {dict(search.short_of_reach)[best]}"
    )


def _best_short_of_reach(search: Search, method: CatchSearch) -> MotionVariation | None:
    """Return the catch without the reach that is asked for that would be worth most; None if there is none."""
    if not search.short_of_reach:
        return None
    return method.best(dataclasses.replace(search, short_of_reach=())) or search.short_of_reach[-1][0]


def _obstacle(trials: Trials, chosen: Attempt, settings: AdaptSettings, bounds: Bounds, result: RolloutResult) -> str:
    torque = f"joint '{result.effort_joint}'" if result.effort_ratio >= TORQUE_SPENT else None
    limiting = trials.family.swing(MotionVariation(1.0, chosen.variation.amplitude)).limiting_joint()
    return obstacle(chosen, settings, bounds, limiting, torque)


TORQUE_SPENT = 0.999
"""A joint whose torque reached this fraction of its limit did not follow as it should."""


def obstacle(chosen: Attempt, settings: AdaptSettings, bounds: Bounds, limiting_joint: str, torque: str | None) -> str:
    """Return one line: the miss of the ``chosen`` motion, its cause, and which setting to change.

    ``limiting_joint`` is the arm's limit that forbids a faster motion, ``torque`` the joint whose torque was spent in
    its rollout, if any.
    """
    return f"{_how_near(chosen)}: {_cause(chosen, settings, bounds, limiting_joint, torque)}"


def policy_obstacle(chosen: Attempt, search: Search) -> str:
    """Return one line: the miss of the motion ``chosen`` by a search for the shape, and which setting to change."""
    played = sum(one.limit is None for one in search.attempts)
    if played == 0:
        return f"every motion that was tried is forbidden by {search.attempts[-1].limit}: lower adapt.policy.spread_m"
    return (
        f"{_how_near(chosen)}: {played} rollouts did not lead to a robust policy: raise adapt.policy.max_rollouts, "
        "or change adapt.policy.spread_m"
    )


def _how_near(nearest: Attempt) -> str:
    variation = nearest.variation
    at = f"at tau_scale {variation.tau_scale:.4g}"
    if variation.amplitude != 1.0:
        at += f" and amplitude {variation.amplitude:g}"
    if nearest.signed_miss_m is None:
        return (
            f"the ball never came down through the rim's plane; {at} it rose to {1e3 * nearest.apex_m:.0f} mm over it"
        )
    return f"nearest miss {1e3 * nearest.distance_m:.0f} mm {at}"


def _cause(nearest: Attempt, settings: AdaptSettings, bounds: Bounds, limiting_joint: str, torque: str | None) -> str:
    tau, (low, high) = nearest.variation.tau_scale, settings.tau_range
    lowest = bounds.lowest_tau(nearest.variation.amplitude)
    miss_m, side_m = abs(nearest.signed_miss_m or 0.0), abs(nearest.side_miss_m or 0.0)
    causes = (
        (nearest.limit is not None, f"it is forbidden by {nearest.limit}"),
        (torque is not None, f"{torque} is at its torque limit: place the arm otherwise (adapt.placement)"),
        (
            nearest.distance_m < bounds.mouth_m,
            "the ball came down into the cup and jumped out again: lower game.cup.restitution or deepen the cup",
        ),
        (
            side_m > max(bounds.mouth_m, miss_m),
            f"it comes down {1e3 * side_m:.0f} mm off the swing plane, whatever tau is: raise adapt.max_shift_m",
        ),
        (
            lowest > low and tau - lowest < settings.tau_step,
            f"a faster motion is forbidden by {limiting_joint}: place the arm otherwise (adapt.placement)",
        ),
        (
            tau - low < settings.tau_step,
            f"a faster motion is forbidden by adapt.tau_range, which begins at {low:g}: lower it",
        ),
        (
            high - tau < settings.tau_step,
            f"a slower motion is forbidden by adapt.tau_range, which ends at {high:g}: raise it",
        ),
        (
            nearest.apex_m < MIN_APEX_M,
            "the swing is too weak for the rope: widen adapt.amplitudes or shorten game.rope.length_m",
        ),
    )
    named = (cause for holds, cause in causes if holds)
    return next(named, "no tau within the range does better: raise adapt.max_shift_m or widen adapt.amplitudes")
