"""What was done on the robot as log messages: (topic, time, message), thinned out to a wanted period."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence

import cv2

from kendama_cli.artifacts.catch_pose import CatchPose
from kendama_cli.control.catch_game import Game
from kendama_cli.control.cup_cart import CartStep
from kendama_cli.control.swing_up import SwingUpRollout
from kendama_cli.devices.robot.exchange_log import exchange_message
from kendama_cli.devices.robot.interface import Exchange
from kendama_cli.learning.interface import FinishedRollout
from kendama_cli.log.messages import DetectionMessage, RolloutMessage, WrenchMessage
from kendama_cli.schema.arrays import Array
from kendama_cli.schema.foxglove import CompressedImage, FrameTransform, FrameTransforms, JointStates
from kendama_cli.stages.transfer.messages import GameEstimateMessage, GameMessage, TransferStepMessage

JPEG_QUALITY = 80
TimedMessage = tuple[str, float, object]


def step_messages(steps: Sequence[CartStep], rollout: int, start_s: float, every: int) -> Iterator[TimedMessage]:
    """/transfer/step of every ``every``-th control period."""
    for step in steps[::every]:
        message = TransferStepMessage(rollout, **step.state._asdict(), action_m_s2=step.acceleration_m_s2)
        yield "/transfer/step", start_s + step.t_s, message


def timed(played: Sequence[Exchange], start_s: float) -> list[tuple[float, Exchange]]:
    """Control periods with their times in the log; the first, the rest before them, is at ``start_s``."""
    return [(start_s + one.t_s - played[0].t_s, one) for one in played]


def exchange_messages(timed: Sequence[tuple[float, Exchange]], joint_names: Sequence[str]) -> Iterator[TimedMessage]:
    """/transfer/exchange of every control period; the first of ``timed`` is the rest before them, and was not sent."""
    for t_s, exchange in timed[1:]:
        yield "/transfer/exchange", t_s, exchange_message(joint_names, exchange)


def rollout_message(topic: str, swing: SwingUpRollout, finished: FinishedRollout, start_s: float) -> TimedMessage:
    """A learning rollout under ``topic``, at its end."""
    message = RolloutMessage(
        index=finished.index,
        explored=finished.explored,
        reward=finished.reward,
        success=finished.success,
        duration_s=swing.duration_s,
        peak_displacement_m=swing.peak_displacement_m,
        half_swings=swing.half_swings,
    )
    return topic, start_s + swing.duration_s, message


def scene_messages(
    timed: Sequence[tuple[float, Exchange]],
    joint_names: Sequence[str],
    every: int,
    *,
    cup_rotation: Callable[[Array], Array],
    links: Callable[[Array], FrameTransforms],
    under: str = "/transfer",
) -> Iterator[TimedMessage]:
    """Joints (of a whole game only), links, wrench, cup and ball of every ``every``-th control period, below ``under``.

    ``cup_rotation`` gives the cup's rotation (4,), ``links`` the arm's frames for joint angles.
    """
    for t_s, exchange in timed[::every]:
        state = exchange.state
        if under == "/transfer":
            joints = JointStates(joint_names, state.position_rad, state.velocity_rad_s, state.effort_nm)
            yield f"{under}/joints", t_s, joints
        yield f"{under}/links", t_s, links(state.position_rad)
        yield f"{under}/wrench", t_s, WrenchMessage(*state.wrist_wrench.tolist())
        yield (
            f"{under}/cup",
            t_s,
            FrameTransform("world", "cup", state.cup_in_world_m, cup_rotation(state.position_rad)),
        )
        yield f"{under}/ball", t_s, FrameTransform("world", "ball", state.ball_in_world_m)


def game_messages(game: Game, index: int, start_s: float, horizon_s: float) -> Iterator[TimedMessage]:
    """Sightings, images and estimates of one game, and how it ended."""
    observed = game.observed
    for frame in observed.frames:
        seen = frame.sighting
        u_px, v_px = (math.nan, math.nan) if seen is None else seen.centre_px.tolist()
        detection = DetectionMessage(
            flight=index,
            camera=frame.camera,
            u_px=u_px,
            v_px=v_px,
            radius_px=math.nan if seen is None else seen.radius_px,
            seen=seen is not None,
        )
        yield "/transfer/detection", start_s + frame.t_s, detection
    for picture in observed.pictures:
        jpeg = cv2.imencode(".jpg", picture.pixels, [cv2.IMWRITE_JPEG_QUALITY, JPEG_QUALITY])[1].tobytes()
        yield f"/transfer/image/{picture.camera}", start_s + picture.t_s, CompressedImage(picture.camera, "jpeg", jpeg)
    for prediction in game.estimates:
        yield "/transfer/estimate", start_s + prediction.t_s, _estimate(prediction.rim, index, start_s)
    end_s = (game.steps or game.swing.steps)[-1].t_s
    yield "/transfer/game", start_s + end_s, _game(game, index, start_s, horizon_s)


def _estimate(pose: CatchPose, index: int, start_s: float) -> GameEstimateMessage:
    x_m, y_m, z_m = pose.position_m.tolist()
    velocity_x, velocity_y, velocity_z = pose.velocity_m_s.tolist()
    return GameEstimateMessage(
        game=index,
        t_catch_s=start_s + pose.t_s,
        sigma_t_s=pose.time_sigma_s,
        x_m=x_m,
        y_m=y_m,
        z_m=z_m,
        velocity_x_m_s=velocity_x,
        velocity_y_m_s=velocity_y,
        velocity_z_m_s=velocity_z,
        covariance_m2=pose.covariance_m2.ravel(),
    )


def _game(game: Game, index: int, start_s: float, horizon_s: float) -> GameMessage:
    observed, catch, crossing = game.observed, game.catch, game.crossing
    error_m = game.prediction_error_m(horizon_s)
    return GameMessage(
        index=index,
        swung_up=game.swung_up,
        predicted=bool(game.estimates),
        caught=game.caught,
        prediction_error_mm=math.nan if error_m is None else 1e3 * error_m,
        outcome=game.outcome,
        since_s=math.nan if catch is None else start_s + catch.since_s,
        free_s=math.nan if observed.free_s is None else start_s + observed.free_s,
        frames=len(observed.frames),
        seen=observed.seen,
        latency_frames=math.nan if observed.latency_frames is None else observed.latency_frames,
        blow_n=math.nan if catch is None else catch.blow_n,
        crossing_s=math.nan if crossing is None else start_s + crossing.t_s,
        crossing_m=() if crossing is None else crossing.place_m,
    )
