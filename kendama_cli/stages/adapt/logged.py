"""What adapt logs of its windows, of the worlds that it drew, and of the motion that it chose."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

from kendama_cli.adaptation.search_record import Search
from kendama_cli.adaptation.time_scaling import Window
from kendama_cli.adaptation.uncertainty import Draw
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
from kendama_cli.simulation.dart.world_errors import WorldErrors
from kendama_cli.stages.adapt.messages import AdaptPerturbationMessage, AdaptWindowMessage
from kendama_cli.stages.interface import StageContext


def log_windows(ctx: StageContext, found: Sequence[Window], search: Search) -> None:
    """The windows, each with its middle and what the rope does in its swing."""
    for index, window in enumerate(found):
        tau = window.best.tau_scale
        slack_s = max(one.swing_slack_s for one in search.attempts if one.variation.tau_scale == tau)
        ctx.log.write("/adapt/window", float(index), AdaptWindowMessage(index, window.low, window.high, tau, slack_s))


def draw_message(index: int, draw: Draw, game: GameSettings) -> AdaptPerturbationMessage:
    """What was drawn for the repeat ``index``."""
    world = draw.world
    return AdaptPerturbationMessage(
        index=index,
        rope_scale=world.rope_scale,
        ball_start_m=world.ball_start_m,
        mass_scale=world.mass_scale,
        drag_scale=world.drag_scale,
        restitution=game.cup.restitution if world.restitution is None else world.restitution,
        joint_friction_nm=world.joint_friction_nm,
        joint_friction_fraction=world.joint_friction_fraction,
        lag_s=draw.arm.lag_s,
        cup_error_m=draw.arm.cup_error_m,
        cup_error_hz=draw.arm.cup_error_hz,
        cup_error_phase_rad=draw.arm.cup_error_phase_rad,
    )


def log_replay(ctx: StageContext, index: int, world: ArmWorld, drawn: WorldErrors, result: RolloutResult) -> None:
    """What another physics needs to play the repeat again."""
    trace, game = result.trace, world.ball.game
    if trace is None:
        return
    message = ReplayMessage(
        index=index,
        rope_m=world.ball.rope_m,
        rope_kg=world.ball.chain.rope_kg,
        ball_kg=world.ball.mass_kg - world.ball.chain.end_kg,
        drag_n_s_m=drawn.drag_scale * game.drag[0],
        drag_n_s2_m2=drawn.drag_scale * game.drag[1],
        restitution=game.cup.restitution if drawn.restitution is None else drawn.restitution,
        since_s=0.0,
        caught=result.caught,
        miss_m=float("nan") if result.signed_miss_m is None else result.signed_miss_m,
        t_s=trace.t_s,
        cup_m=trace.cup_m.ravel(),
        cup_axis=trace.cup_axis.ravel(),
        ball_m=trace.ball_m.ravel(),
    )
    ctx.log.write("/adapt/replay", float(index), message)


def turned_trace(trace: Trace, angle_rad: float) -> Trace:
    """Return ``trace`` as it is in a world turned by ``angle_rad`` about z; joints are what they are."""
    back = heading_turn(-angle_rad)
    places = {name: getattr(trace, name) @ back for name in ("cup_m", "ball_m", "cup_axis")}
    return dataclasses.replace(trace, **places)


LINKS_EVERY = 2
"""Samples of the trace between two of the links: 20 ms, the arm being smooth between them."""


def log_chosen(ctx: StageContext, arm: RobotModel, game: GameSettings, trace: Trace, reference_m: Array) -> None:
    """The chosen motion: the arm's looks, links and joints, cup, ball, and where the cup should be (n, 3)."""
    scene = ArmScene(arm)
    ctx.log.write("/adapt/scene", 0.0, scene.shapes(game))
    for number, k in enumerate(trace.even.tolist()):
        t_s, position = float(trace.t_s[k]), trace.position_rad[k]
        states = JointStates(arm.joint_names, position, trace.velocity_rad_s[k], trace.effort_nm[k])
        ctx.log.write("/adapt/joints", t_s, states)
        if number % LINKS_EVERY == 0:
            ctx.log.write("/adapt/links", t_s, scene.frames(position))
    turns = [quaternion_of(cup_frame(tuple(axis))) for axis in trace.cup_axis.tolist()]
    for child, places_m in (("cup", trace.cup_m), ("ball", trace.ball_m), ("reference", reference_m)):
        for t_s, place, turn in zip(trace.t_s.tolist(), places_m, turns, strict=True):
            rotation = turn if child == "cup" else UPRIGHT_WXYZ
            ctx.log.write(f"/adapt/{child}", t_s, FrameTransform(WORLD, child, place, rotation))
