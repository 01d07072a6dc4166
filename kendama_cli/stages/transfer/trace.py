"""Log messages (topic, time, message) of what was done on the robot, thinned out to a period."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence

import cv2
import numpy as np

from kendama_cli.artifacts.catch_pose import CatchPose
from kendama_cli.control.catch_game import Game
from kendama_cli.control.cup_cart import CartStep
from kendama_cli.control.scene_history import SceneHistory
from kendama_cli.control.swing_up import SwingUpRollout
from kendama_cli.devices.robot.exchange_log import exchange_message
from kendama_cli.devices.robot.interface import Exchange
from kendama_cli.learning.interface import FinishedRollout
from kendama_cli.log.messages import ReplayMessage, WrenchMessage
from kendama_cli.physics.rim_crossing import SampledBody, SampledWays
from kendama_cli.physics.taut_rope import stretch_m
from kendama_cli.schema.arrays import Array
from kendama_cli.schema.foxglove import CompressedImage, FrameTransform, FrameTransforms, JointStates
from kendama_cli.settings.game import GameSettings
from kendama_cli.settings.hardware import HardwareSettings, SimulatedHardware, TwinHardware
from kendama_cli.settings.robot import Imperfection
from kendama_cli.stages.transfer.messages import GameEstimateMessage, GameMessage, TransferStepMessage
from kendama_cli.vision.detection.interface import detection_message

JPEG_QUALITY = 80
TimedMessage = tuple[str, float, object]


def step_messages(steps: Sequence[CartStep], rollout: int, start_s: float, every: int) -> Iterator[TimedMessage]:
    """Yield /transfer/step of every ``every``-th control period."""
    for step in steps[::every]:
        message = TransferStepMessage(rollout, **step.state._asdict(), action_m_s2=step.acceleration_m_s2)
        yield "/transfer/step", start_s + step.t_s, message


def timed(played: Sequence[Exchange], start_s: float) -> list[tuple[float, Exchange]]:
    """Return control periods with their times in the log; the first, the rest before them, is at ``start_s``."""
    return [(start_s + one.t_s - played[0].t_s, one) for one in played]


def exchange_messages(timed: Sequence[tuple[float, Exchange]], joint_names: Sequence[str]) -> Iterator[TimedMessage]:
    """Yield /transfer/exchange of every control period; the first of ``timed``, the rest before them, was not sent."""
    for t_s, exchange in timed[1:]:
        yield "/transfer/exchange", t_s, exchange_message(joint_names, exchange)


def rollout_message(topic: str, swing: SwingUpRollout, finished: FinishedRollout, start_s: float) -> TimedMessage:
    """Return a learning rollout under ``topic``, at its end."""
    return topic, start_s + swing.duration_s, finished.message(swing)


def scene_messages(
    timed: Sequence[tuple[float, Exchange]],
    joint_names: Sequence[str],
    every: int,
    *,
    cup_rotation: Callable[[Array], Array],
    links: Callable[[Array], FrameTransforms],
    under: str = "/transfer",
) -> Iterator[TimedMessage]:
    """Yield joints (of whole games only), links, wrench, cup and ball of every ``every``-th period, below ``under``.

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
    """Yield detections, images and estimates of one game, and its end."""
    observed = game.observed
    for frame in observed.frames:
        detection = detection_message(index, frame.camera, frame.sighting)
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
        crossing_m=() if crossing is None else crossing.position_m,
    )


UPRIGHT = np.array([0.0, 0.0, 1.0])


def imperfection(hardware: HardwareSettings) -> Imperfection | None:
    """Return how the robot differs from the model, which only the settings of our own simulated ones tell."""
    return hardware.imperfection if isinstance(hardware, SimulatedHardware | TwinHardware) else None


def played_body(settings: GameSettings, made: Imperfection | None, history: SceneHistory) -> SampledBody:
    """Return the body of the game in ``history``: the simulated robot's own if ``made`` says how it was made.

    Its rope is what is left of the distance from the true tie to the ball, which hangs at rest as a game begins, after
    the weight's stretch m g / Ks. Otherwise the body is that of the settings on the rope that was measured.
    """
    (linear, quadratic), mass_kg, rope_m = settings.drag, settings.ball.mass_kg, history.rope_m
    if made is not None:
        linear, quadratic = made.drag_scale * linear, made.drag_scale * quadratic
        mass_kg *= made.mass_scale
    if made is not None and history.reported:
        first = history.rollout()[0]
        stretched_m = float(np.linalg.norm(first[7:] - first[1:4]))
        rope_m = stretched_m - stretch_m(mass_kg * settings.gravity_m_s2, settings.rope.stiffness_n_m)
    return SampledBody(rope_m, mass_kg, (linear, quadratic), settings.cup.restitution, 0.0)


def replay_message(
    index: int,
    game: Game,
    steps: Sequence[CartStep],
    history: SceneHistory,
    settings: GameSettings,
    *,
    made: Imperfection | None = None,
) -> ReplayMessage:
    """Return the true paths of cup and ball if the robot reports them, else the tracked ones of an upright cup.

    With ``made``, that of the simulated robot, the body is its own.
    """
    body = played_body(settings, made, history)
    path = history.rollout() if history.reported else _tracked(steps)
    t_s, cup_m, axis, ball_m = path[:, 0], path[:, 1:4], path[:, 4:7], path[:, 7:]
    since_s = game.swing.duration_s
    miss_m = SampledWays(t_s, cup_m, axis, ball_m).miss_m(settings, since_s)
    return ReplayMessage(
        index=index,
        rope_m=body.rope_m,
        rope_kg=body.rope_kg,
        ball_kg=body.ball_kg,
        drag_n_s_m=body.drag[0],
        drag_n_s2_m2=body.drag[1],
        restitution=body.restitution,
        since_s=since_s,
        caught=game.caught,
        miss_m=float("nan") if miss_m is None else miss_m[0],
        t_s=t_s,
        cup_m=cup_m.ravel(),
        cup_axis=axis.ravel(),
        ball_m=ball_m.ravel(),
    )


def _tracked(steps: Sequence[CartStep]) -> Array:
    states = [(one.t_s, one.exchange.state) for one in steps]
    return np.array([[t_s, *state.cup_in_world_m, *UPRIGHT, *state.ball_in_world_m] for t_s, state in states])
