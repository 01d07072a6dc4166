"""Adapt: the primitive is fitted to the arm until the arm catches."""

from __future__ import annotations

import functools
from collections.abc import Mapping
from typing import Any

import numpy as np

from kendama_cli.artifacts.motion_plan import CatchMotion, JointTrajectory, MotionPlan
from kendama_cli.errors import StageError
from kendama_cli.settings.adapt import AdaptSettings, PerturbationSettings
from kendama_cli.settings.game import GameSettings
from kendama_cli.settings.robot import RobotSettings
from kendama_cli.simulation.catch_search import (
    Attempt,
    Job,
    Repeat,
    Search,
    best_candidate,
    nearest_attempt,
    next_job,
)
from kendama_cli.simulation.rollout import Trace, play_rollout
from kendama_cli.simulation.swing import Swing, scaled_plan
from kendama_cli.simulation.world import NO_ERRORS, ArmWorld, WorldErrors
from kendama_cli.stages.interface import Made, Metric, StageContext, State


class Adapt:
    """Takes the MotionPlan of ``encode``; gives the CatchMotion of the arm in DART."""

    def __init__(self, *, adapt: AdaptSettings, robot: RobotSettings, game: GameSettings) -> None:
        self._settings = adapt
        self._robot = robot
        self._game = game

    def run(self, given: Mapping[str, Any], ctx: StageContext) -> Made:
        """Search tau, then amplitude, in the closed loop; the result is judged by perturbed repeats.

        ``caught`` is the nominal outcome, ``success_rate`` that over fresh perturbed repeats. Where nothing catches
        the stage still ends, and its metrics tell how near it came. Raises StageError, naming the joint and its
        limit, where no tau in the range is within the arm's limits.
        """
        plan: MotionPlan = given["encode"]
        world = ArmWorld(self._robot, self._game)
        swings = self._swings(world, plan)
        lowest = {amplitude: swing.least_tau_scale() for amplitude, swing in swings.items()}
        saved = ctx.restore()
        search = Search() if saved is None else Search.from_json(saved["search"])
        if saved is None:
            draws = ctx.rng("adapt repeats").integers(2**62, size=self._settings.judge_repeats + self._settings.repeats)
            seeds = [int(seed) for seed in draws]
        else:
            seeds = [int(seed) for seed in saved["seeds"]]
        while (job := next_job(search, self._settings, lowest)) is not None:
            joints = swings[job.amplitude].joints(job.tau_scale, self._settings.hold_s)
            if job.kind == "attempt":
                search = search.with_attempt(self._attempt(world, joints, job, ctx))
            else:
                fresh = self._settings.judge_repeats if job.kind == "confirm" else 0
                repeat = self._repeat(world, joints, seeds[fresh + job.index])
                search = search.with_repeat(job, repeat)
                if job.kind == "confirm":
                    message = {"index": job.index, "caught": repeat.caught, "miss_m": _or_nan(repeat.miss_m)}
                    ctx.log.write("/adapt/repeat", float(job.index), message)
            ctx.checkpoint(functools.partial(_state, search, seeds))
            ctx.progress(search.rollouts() + len(search.confirmed), None, **_figures(search))
        return self._made(world, plan, swings, search, ctx)

    def _swings(self, world: ArmWorld, plan: MotionPlan) -> dict[float, Swing]:
        swings = {1.0: Swing(world.arm, plan, self._settings.lead_in_m_s2)}
        least, most = swings[1.0].least_tau_scale(), self._settings.tau_range[1]
        if least > most:
            raise StageError(
                f"the motion would have to be {least:.2f} times slower for {self._robot.name}, whose "
                f"{swings[1.0].limiting_joint()} stands in the way; allowed: tau_scale up to {most}: "
                "raise adapt.tau_range, or place the arm otherwise (robot.home_rad)"
            )
        for amplitude in self._settings.amplitudes:
            try:
                swings[amplitude] = Swing(world.arm, scaled_plan(plan, amplitude, 1.0), self._settings.lead_in_m_s2)
            except StageError:  # too large for the arm: the other amplitudes remain
                continue
        return swings

    def _attempt(self, world: ArmWorld, joints: JointTrajectory, job: Job, ctx: StageContext) -> Attempt:
        world.perturb(NO_ERRORS)
        result = play_rollout(world, joints)
        message = {
            "index": job.index,
            "tau_scale": job.tau_scale,
            "signed_miss_m": _or_nan(result.signed_miss_m),
            "caught": result.caught,
        }
        ctx.log.write("/adapt/rollout", float(job.index), message)
        return Attempt(job.amplitude, job.tau_scale, result.caught, result.signed_miss_m, result.apex_m)

    def _repeat(self, world: ArmWorld, joints: JointTrajectory, seed: int) -> Repeat:
        rng = np.random.default_rng(seed)
        world.perturb(_draw(self._settings.perturbation, self._game.rope.length_m, rng))
        result = play_rollout(world, joints, noise_rad=self._settings.perturbation.joint_noise_rad, rng=rng)
        return Repeat(result.caught, result.signed_miss_m)

    def _made(
        self, world: ArmWorld, plan: MotionPlan, swings: dict[float, Swing], search: Search, ctx: StageContext
    ) -> Made:
        best = best_candidate(search)
        nearest = nearest_attempt(search)
        amplitude, tau = best or (nearest.amplitude, nearest.tau_scale)
        joints = swings[amplitude].joints(tau, self._settings.hold_s)
        world.perturb(NO_ERRORS)
        result = play_rollout(world, joints, record=True)
        if result.trace is not None:
            _log_trace(ctx, joints.joint_names, result.trace)
            _log_frames(
                ctx,
                "/adapt/reference",
                "reference",
                result.trace.t_s,
                swings[amplitude].cup_reference_m(tau, result.trace.t_s),
            )
        success = sum(repeat.caught for repeat in search.confirmed) / max(len(search.confirmed), 1)
        metrics: dict[str, Metric] = {
            "caught": result.caught,
            "tau_scale": tau,
            "rollouts": search.rollouts(),
            "success_rate": success,
            "rollouts_to_first_catch": search.rollouts_to_first_catch(),
            "amplitude": amplitude,
            "signed_miss_mm": None if result.signed_miss_m is None else 1e3 * result.signed_miss_m,
            "side_miss_mm": None if result.side_miss_m is None else 1e3 * result.side_miss_m,
            "apex_mm": 1e3 * result.apex_m,
            "planned_speed_over_limit": float(swings[amplitude].velocity_shares.max() / tau),
            "speed_over_limit": result.velocity_share,
            "effort_over_limit": result.effort_share,
        }
        motion = CatchMotion(scaled_plan(plan, amplitude, tau), joints, result.caught, success)
        return Made(motion, metrics)


def _draw(perturbation: PerturbationSettings, rope_m: float, rng: np.random.Generator) -> WorldErrors:
    rope, ball, friction = rng.uniform(-1, 1), rng.uniform(-1, 1), rng.uniform(0, 1)
    return WorldErrors(
        rope_scale=1 + rope * perturbation.rope_m / rope_m,
        ball_start_m=ball * perturbation.ball_start_m,
        joint_friction_nm=friction * perturbation.joint_friction_nm,
    )


def _state(search: Search, seeds: list[int]) -> State:
    return {"search": search.to_json(), "seeds": seeds}


def _or_nan(value: float | None) -> float:
    return float("nan") if value is None else value


def _figures(search: Search) -> dict[str, float | int]:
    figures: dict[str, float | int] = {"tau": round(search.attempts[-1].tau_scale, 4)}
    figures["caught"] = sum(one.caught for one in search.attempts)
    if search.confirmed:
        figures["success_rate"] = round(sum(one.caught for one in search.confirmed) / len(search.confirmed), 2)
    return figures


def _log_trace(ctx: StageContext, joint_names: tuple[str, ...], trace: Trace) -> None:
    for t_s, position, velocity, effort in zip(
        trace.t_s, trace.position_rad, trace.velocity_rad_s, trace.effort_nm, strict=True
    ):
        message = {
            "names": list(joint_names),
            "position_rad": position,
            "velocity_rad_s": velocity,
            "effort_nm": effort,
        }
        ctx.log.write("/adapt/joints", float(t_s), message)
    _log_frames(ctx, "/adapt/cup", "cup", trace.t_s, trace.cup_m)
    _log_frames(ctx, "/adapt/ball", "ball", trace.t_s, trace.ball_m)


def _log_frames(ctx: StageContext, topic: str, child: str, t_s: Any, places_m: Any) -> None:
    for t, place in zip(t_s, places_m, strict=True):
        ctx.log.write(topic, float(t), {"parent": "world", "child": child, "position_m": place})
