"""Adapt: the primitive is fitted to the arm until the arm catches."""

from __future__ import annotations

import contextlib
import dataclasses
import functools
from collections.abc import Mapping
from typing import Any

import numpy as np

from kendama_cli.artifacts.motion_plan import CatchMotion, MotionPlan
from kendama_cli.artifacts.proportion import success_interval
from kendama_cli.artifacts.toy_model import SIGMAS_95, ToyModel
from kendama_cli.errors import StageError
from kendama_cli.learning.friction_known import with_identified
from kendama_cli.robot_model.arm_motion import ArmMotion
from kendama_cli.robot_model.model import RobotModel
from kendama_cli.settings.game import GameSettings
from kendama_cli.settings.placement import placed
from kendama_cli.settings.robot import RobotSettings
from kendama_cli.simulation.catch.catch_family import CatchFamily
from kendama_cli.simulation.catch.catch_obstacle import TORQUE_SPENT, obstacle
from kendama_cli.simulation.catch.catch_search import (
    best_candidate,
    expected_success,
    nearest_attempt,
    next_trial,
    windows,
)
from kendama_cli.simulation.catch.search_record import Attempt, Bounds, MotionVariation, Search, Trial
from kendama_cli.simulation.catch.settings import AdaptSettings
from kendama_cli.simulation.catch.tilt import playable_tilt
from kendama_cli.simulation.catch.uncertainty import CORNERS, Repeat, corner_errors, drawn_errors
from kendama_cli.simulation.dart.rollout import RolloutResult
from kendama_cli.simulation.dart.world import ArmWorld
from kendama_cli.simulation.placement.find_placement import current_placement, find_placement
from kendama_cli.stages.adapt.logged import draw_message, log_chosen, log_replay, log_windows
from kendama_cli.stages.adapt.messages import (
    AdaptRepeatMessage,
    AdaptRolloutMessage,
)
from kendama_cli.stages.adapt.rollouts import Rollouts
from kendama_cli.stages.interface import Made, Metric, StageContext, State


class Adapt:
    """Takes the MotionPlan of ``encode``; gives the CatchMotion of the arm in DART."""

    def __init__(self, *, adapt: AdaptSettings, robot: RobotSettings, game: GameSettings) -> None:
        self._settings, self._robot, self._game = adapt, robot, game

    def run(self, given: Mapping[str, Any], ctx: StageContext) -> Made:
        """Search tau, then goal and size, in the closed loop; the result is judged by perturbed repeats.

        ``caught`` is the nominal outcome, ``success_rate`` that over fresh perturbed repeats. Where nothing catches
        the stage still ends, and its metrics say how near it came and what stands in the way. Raises StageError,
        naming the joint and its limit, where no tau in the range is within the arm's limits.
        """
        plan: MotionPlan = given["encode"]
        toy: ToyModel | None = given.get("measure")
        if toy is not None:
            self._game, self._settings = toy.applied(self._game), _narrowed(self._settings, toy)
        settings = self._settings
        robot = self._placed(with_identified(self._robot, given.get("identify")), plan, ctx)
        world = ArmWorld(robot, self._game)
        plan, warnings = playable_tilt(world.arm, plan, settings)
        family = CatchFamily(world.arm, plan, settings.lead_in_m_s2)
        rollouts = Rollouts(world, family, settings, self._game)
        bounds = family.bounds(settings.amplitudes, self._game.cup.radius_m)
        self._require_playable(family, bounds)
        saved = ctx.restore()
        search = Search() if saved is None else Search.from_json(saved["search"])
        if saved is None:
            seeds = ctx.rng("adapt repeats").integers(2**62, size=len(CORNERS) + settings.repeats).tolist()
        else:
            seeds = [int(seed) for seed in saved["seeds"]]
        while (trial := next_trial(search, settings, bounds)) is not None:
            if trial.kind == "attempt":
                search = search.with_attempt(self._attempt(rollouts, trial, ctx))
            else:
                if trial.kind == "evaluate" and trial.index == 0:
                    rollouts.require_reach(trial.variation, search.flight(trial.variation))
                search = search.with_repeat(trial, self._repeat(rollouts, trial, seeds, ctx))
            ctx.checkpoint(functools.partial(_state, search, seeds))
            total = search.rollouts() + settings.repeats if trial.kind == "confirm" else None
            ctx.progress(search.rollouts() + len(search.confirmed), total, **_figures(trial, search))
        return dataclasses.replace(self._made(rollouts, bounds, search, seeds, ctx), warnings=warnings)

    def _placed(self, robot: RobotSettings, plan: MotionPlan, ctx: StageContext) -> RobotSettings:
        """The arm where it stands, or where the search finds that it should: the same after a resumption.

        The swing-up's line is kept in reach too, unless that leaves the motion beyond every tau that is allowed.
        """
        if self._settings.placement == "given":
            return robot

        def report_progress(done: int, total: int, cost: float) -> None:
            ctx.progress(done, total, placement=round(cost, 3))

        lead_in = self._settings.lead_in_m_s2
        find = functools.partial(find_placement, robot, self._game, plan, lead_in, effort=1.0, progress=report_progress)
        with contextlib.suppress(StageError):  # out of reach: perhaps only the line is
            found = placed(robot, find(line=self._settings.line))
            arm = RobotModel(found, self._game.cup, self._game.gravity_m_s2)
            if ArmMotion(arm, plan, lead_in).least_tau_scale() <= self._settings.tau_range[1]:
                return found
        return placed(robot, find(line=None))

    def _require_playable(self, family: CatchFamily, bounds: Bounds) -> None:
        least, most = bounds.lowest_tau[1.0], self._settings.tau_range[1]
        if least > most:
            given = self._settings.placement == "given"
            otherwise = "place the arm otherwise (adapt.placement=search)" if given else "choose another robot"
            raise StageError(
                f"the motion would have to be {least:.2f} times slower for {self._robot.name}, whose "
                f"{family.swing(MotionVariation(1.0)).limiting_joint()} stands in the way; "
                f"allowed: tau_scale up to {most}: raise adapt.tau_range, or {otherwise}"
            )

    def _attempt(self, rollouts: Rollouts, trial: Trial, ctx: StageContext) -> Attempt:
        variation = trial.variation
        limit = rollouts.family.limit(variation)
        if limit is not None:
            return Attempt(variation, False, None, None, 0.0, None, limit)
        result = rollouts.planned(variation)
        ctx.log.write(
            "/adapt/rollout", float(trial.index), _rollout_message(trial, result.caught, result.signed_miss_m)
        )
        return _attempt_made(variation, rollouts.family.swing(variation), result)

    def _repeat(self, rollouts: Rollouts, trial: Trial, seeds: list[int], ctx: StageContext) -> Repeat:
        """Every candidate is evaluated with the same noise; those that confirm have noise of their own."""
        uncertainty, rope_m = self._settings.uncertainty, self._game.rope.length_m
        confirm = trial.kind == "confirm"
        seed = seeds[trial.index + len(CORNERS) * confirm]
        rng = np.random.default_rng(seed)
        draw = drawn_errors(uncertainty, rope_m, rng) if confirm else corner_errors(uncertainty, rope_m, trial.index)
        result, shift_m = rollouts.judged(trial.variation, draw, eyes_seed=seed, rng=rng, record=confirm)
        miss_m = _or_nan(result.signed_miss_m)
        if confirm:
            message = AdaptRepeatMessage(index=trial.index, caught=result.caught, miss_m=miss_m, shift_m=shift_m)
            ctx.log.write("/adapt/repeat", float(trial.index), message)
            log_replay(ctx, trial.index, rollouts.world, draw.world, result)
            ctx.log.write("/adapt/drawn", float(trial.index), draw_message(trial.index, draw, self._game))
        else:
            ctx.log.write("/adapt/corner", float(trial.index), _rollout_message(trial, result.caught, miss_m))
        return Repeat(result.caught, result.signed_miss_m)

    def _made(self, rollouts: Rollouts, bounds: Bounds, search: Search, seeds: list[int], ctx: StageContext) -> Made:
        best, family = best_candidate(search, bounds), rollouts.family
        variation = best or nearest_attempt(search).variation
        swing = family.swing(variation)
        joints = swing.joints(variation.tau_scale, self._settings.hold_s)
        result, _ = rollouts.judged(variation, None, eyes_seed=seeds[0], record=True)
        if result.trace is not None:
            reference_m = swing.cup_reference_m(variation.tau_scale, result.trace.t_s)
            log_chosen(ctx, rollouts.world.arm, self._game, result.trace, reference_m)
        found = windows(search, self._settings, bounds)
        log_windows(ctx, found, search)
        successes, repeats = sum(repeat.caught for repeat in search.confirmed), len(search.confirmed)
        success = successes / max(repeats, 1)
        interval = success_interval(successes, repeats)
        metrics: dict[str, Metric] = {"caught": result.caught}
        if not result.caught:
            torque = f"joint '{result.effort_joint}'" if result.effort_share >= TORQUE_SPENT else None
            limiting = family.swing(MotionVariation(1.0, variation.amplitude)).limiting_joint()
            metrics["in_the_way"] = obstacle(search, self._settings, bounds, limiting, torque)
        metrics |= {
            "tau_scale": variation.tau_scale,
            "rollouts": search.rollouts(),
            "catch": self._settings.catch,
            "uncertainty": self._settings.uncertainty.name,
            "success_rate": success,
            "success_rate_low": interval.low if repeats else None,
            "success_rate_high": interval.high if repeats else None,
            "predicted_success": None if best is None else expected_success(search, best, bounds),
            "windows": len(found),
            "rollouts_to_first_catch": search.rollouts_to_first_catch(),
            "amplitude": variation.amplitude,
            "shift_mm": 1e3 * float(np.hypot(*variation.shift_m)),
            "signed_miss_mm": None if result.signed_miss_m is None else 1e3 * result.signed_miss_m,
            "side_miss_mm": None if result.side_miss_m is None else 1e3 * result.side_miss_m,
            "swing_slack_ms": 1e3 * result.swing_slack_s,
            "apex_mm": 1e3 * result.apex_m,
            "planned_speed_over_limit": float(swing.velocity_shares.max() / variation.tau_scale),
            "speed_over_limit": result.velocity_share,
            "effort_over_limit": result.effort_share,
        }
        placement = current_placement(rollouts.world.arm)
        return Made(CatchMotion(family.plan(variation), joints, placement, result.caught, success), metrics)


def _attempt_made(variation: MotionVariation, swing: ArmMotion, result: RolloutResult) -> Attempt:
    flight = None
    if result.flight_s is not None:
        start, end = ((t_s / variation.tau_scale - swing.lead_in_s) / swing.plan.duration_s for t_s in result.flight_s)
        flight = (start, end)
    return Attempt(
        variation,
        result.caught,
        result.signed_miss_m,
        result.side_miss_m,
        result.apex_m,
        flight,
        swing_slack_s=result.swing_slack_s,
    )


def _rollout_message(trial: Trial, caught: bool, miss_m: float | None) -> AdaptRolloutMessage:
    return AdaptRolloutMessage(
        index=trial.index,
        tau_scale=trial.variation.tau_scale,
        signed_miss_m=_or_nan(miss_m),
        caught=caught,
        amplitude=trial.variation.amplitude,
        shift_x_m=trial.variation.shift_m[0],
        shift_y_m=trial.variation.shift_m[1],
    )


def _state(search: Search, seeds: list[int]) -> State:
    return {"search": search.to_json(), "seeds": seeds}


def _or_nan(value: float | None) -> float:
    return float("nan") if value is None else value


def _figures(trial: Trial, search: Search) -> dict[str, float | int]:
    figures: dict[str, float | int] = {"tau": round(trial.variation.tau_scale, 4), "caught": search.caught()}
    if search.confirmed:
        figures["success_rate"] = round(sum(one.caught for one in search.confirmed) / len(search.confirmed), 2)
    return figures


def _narrowed(settings: AdaptSettings, toy: ToyModel) -> AdaptSettings:
    """The declared uncertainty with a rope that is no less certain than it was measured."""
    declared = settings.uncertainty
    known_m = min(declared.rope_m, SIGMAS_95 * toy.rope_sigma_m)
    return dataclasses.replace(settings, uncertainty=dataclasses.replace(declared, rope_m=known_m))
