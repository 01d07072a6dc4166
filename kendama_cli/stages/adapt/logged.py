"""Messages of adapt: its trials and windows, the perturbed simulations, and the motion that it chose."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

from kendama_cli.adaptation.perturbation import Perturbation
from kendama_cli.adaptation.policy_search import cost_m
from kendama_cli.adaptation.search_record import Attempt, Search, Trial
from kendama_cli.adaptation.time_scaling import Window
from kendama_cli.log.messages import ReplayMessage
from kendama_cli.motion.dmp.heading import heading_turn
from kendama_cli.motion.rotation import quaternion_of
from kendama_cli.robot_model.arm_scene import WORLD, ArmScene
from kendama_cli.robot_model.cup import cup_frame
from kendama_cli.robot_model.model import RobotModel
from kendama_cli.schema.arrays import Array
from kendama_cli.schema.foxglove import UPRIGHT_WXYZ, FrameTransform, JointStates
from kendama_cli.settings.game import GameSettings
from kendama_cli.simulation.dart.rollout import RolloutResult, Trace
from kendama_cli.simulation.dart.world import ArmWorld
from kendama_cli.stages.adapt.messages import (
    AdaptEvaluationMessage,
    AdaptExploredMessage,
    AdaptPerturbationMessage,
    AdaptRepeatMessage,
    AdaptRolloutMessage,
    AdaptWindowMessage,
)
from kendama_cli.stages.interface import StageContext

LINKS_EVERY = 2
"""Samples of the trace between two of the links: 20 ms, the arm being smooth between them."""


def log_attempt(ctx: StageContext, trial: Trial, attempt: Attempt, result: RolloutResult) -> None:
    """Log an attempt, or a rollout of a policy search."""
    if trial.kind == "attempt":
        ctx.log.write("/adapt/rollout", float(trial.index), _rollout_message(trial, result))
        return
    variation = trial.variation
    message = AdaptExploredMessage(
        index=trial.index,
        generation=trial.group,
        tau_scale=variation.tau_scale,
        cost_m=cost_m(attempt),
        miss_m=_or_nan(result.signed_miss_m),
        caught=result.caught,
        shift_x_m=variation.shift_m[0],
        shift_y_m=variation.shift_m[1],
        bumps_m=variation.bumps_m,
        swing_slack_s=result.swing_slack_s,
    )
    ctx.log.write("/adapt/explored", float(trial.index), message)


def log_repeat(
    ctx: StageContext,
    trial: Trial,
    result: RolloutResult,
    shifts_m: tuple[float, float],
    *,
    world: ArmWorld,
    perturbation: Perturbation,
) -> None:
    """Log a repeat; one that confirms with its ``perturbation``, and all that another physics needs to replay it."""
    index, miss_m = trial.index, _or_nan(result.signed_miss_m)
    if trial.kind == "evaluate":
        ctx.log.write("/adapt/candidate", float(index), _rollout_message(trial, result))
    elif trial.kind == "validate":
        message = AdaptEvaluationMessage(trial.group, index, result.caught, miss_m)
        ctx.log.write("/adapt/evaluation", float(trial.group), message)
    else:
        ctx.log.write("/adapt/repeat", float(index), AdaptRepeatMessage(index, result.caught, miss_m, *shifts_m))
        if result.trace is not None:
            ctx.log.write("/adapt/replay", float(index), _replay_message(index, world, perturbation, result))
        game = world.ball.game
        ctx.log.write("/adapt/perturbation", float(index), _perturbation_message(index, perturbation, game))


def log_windows(ctx: StageContext, found: Sequence[Window], search: Search) -> None:
    """Log the windows, each with its centre and what the rope does in its swing."""
    for index, window in enumerate(found):
        tau = window.best.tau_scale
        slack_s = max(one.swing_slack_s for one in search.attempts if one.variation.tau_scale == tau)
        ctx.log.write("/adapt/window", float(index), AdaptWindowMessage(index, window.low, window.high, tau, slack_s))


def log_chosen(
    ctx: StageContext, arm: RobotModel, game: GameSettings, trace: Trace, *, reference_m: Array, heading_rad: float
) -> None:
    """Log the chosen motion: shapes, links and joints of the arm, cup, ball, and the cup's reference (n, 3).

    ``trace`` and ``reference_m`` are of a swing along x; ``arm`` stands where it goes along ``heading_rad``.
    """
    scene, back = ArmScene(arm), heading_turn(-heading_rad)
    ctx.log.write("/adapt/scene", 0.0, scene.shapes(game))
    for number, k in enumerate(trace.even.tolist()):
        t_s, position = float(trace.t_s[k]), trace.position_rad[k]
        states = JointStates(arm.joint_names, position, trace.velocity_rad_s[k], trace.effort_nm[k])
        ctx.log.write("/adapt/joints", t_s, states)
        if number % LINKS_EVERY == 0:
            ctx.log.write("/adapt/links", t_s, scene.frames(position))
    rotations = [quaternion_of(cup_frame(tuple(axis))) for axis in (trace.cup_axis @ back).tolist()]
    for child, positions_m in (("cup", trace.cup_m), ("ball", trace.ball_m), ("reference", reference_m)):
        for t_s, position_m, turn in zip(trace.t_s.tolist(), positions_m @ back, rotations, strict=True):
            rotation = turn if child == "cup" else UPRIGHT_WXYZ
            ctx.log.write(f"/adapt/{child}", t_s, FrameTransform(WORLD, child, position_m, rotation))


def _perturbation_message(index: int, perturbation: Perturbation, game: GameSettings) -> AdaptPerturbationMessage:
    """Return what was sampled for the repeat ``index``."""
    world, arm = perturbation.world, perturbation.arm
    assert arm is not None
    return AdaptPerturbationMessage(
        index=index,
        rope_scale=world.rope_scale,
        ball_start_m=world.ball_start_m,
        mass_scale=world.mass_scale,
        drag_scale=world.drag_scale,
        restitution=game.cup.restitution if world.restitution is None else world.restitution,
        joint_friction_nm=world.joint_friction_nm,
        joint_friction_fraction=world.joint_friction_fraction,
        ball_start_y_m=world.ball_start_y_m,
        gravity_tilt_y_rad=world.gravity_tilt_y_rad,
        wrist_rotor_scale=world.wrist_rotor_scale,
        image_latency_s=perturbation.sensor.latency_s,
        **dataclasses.asdict(arm),
    )


def _rollout_message(trial: Trial, result: RolloutResult) -> AdaptRolloutMessage:
    return AdaptRolloutMessage(
        index=trial.index,
        tau_scale=trial.variation.tau_scale,
        signed_miss_m=_or_nan(result.signed_miss_m),
        caught=result.caught,
        amplitude=trial.variation.amplitude,
        shift_x_m=trial.variation.shift_m[0],
        shift_y_m=trial.variation.shift_m[1],
        caught_later=result.caught_later,
    )


def _replay_message(index: int, world: ArmWorld, perturbation: Perturbation, result: RolloutResult) -> ReplayMessage:
    trace, ball, errors = result.trace, world.ball, perturbation.world
    assert trace is not None
    return ReplayMessage(
        index=index,
        rope_m=ball.rope_m,
        rope_kg=0.0,
        ball_kg=ball.mass_kg,
        drag_n_s_m=errors.drag_scale * ball.game.drag[0],
        drag_n_s2_m2=errors.drag_scale * ball.game.drag[1],
        restitution=ball.game.cup.restitution if errors.restitution is None else errors.restitution,
        since_s=0.0,
        caught=result.caught,
        miss_m=_or_nan(result.signed_miss_m),
        t_s=trace.t_s,
        cup_m=trace.cup_m.ravel(),
        cup_axis=trace.cup_axis.ravel(),
        ball_m=trace.ball_m.ravel(),
    )


def _or_nan(value: float | None) -> float:
    return float("nan") if value is None else value
