"""What was done on the robot as log messages: (topic, time, message), thinned out to a wanted period."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any

import cv2

from kendama_cli.devices.robot.interface import Exchange
from kendama_cli.game.catch_game import Game
from kendama_cli.game.cup_cart import CartStep
from kendama_cli.game.swing_up import SwingUpRollout
from kendama_cli.learning.sarsa import FinishedRollout
from kendama_cli.schema.arrays import Array

JPEG_QUALITY = 80
Message = tuple[str, float, Mapping[str, Any]]


def step_messages(steps: Sequence[CartStep], rollout: int, start_s: float, every: int) -> Iterator[Message]:
    """/transfer/step of every ``every``-th control period."""
    for step in steps[::every]:
        state = step.state._asdict()
        yield "/transfer/step", start_s + step.t_s, {"rollout": rollout, **state, "action_m_s2": step.acceleration_m_s2}


def rollout_message(topic: str, swing: SwingUpRollout, finished: FinishedRollout, start_s: float) -> Message:
    """A learning rollout under ``topic``, at its end."""
    message = {
        "index": finished.index,
        "explored": finished.explored,
        "reward": finished.reward,
        "success": finished.success,
        "duration_s": swing.duration_s,
        "peak_displacement_m": swing.peak_displacement_m,
        "half_swings": swing.half_swings,
    }
    return topic, start_s + swing.duration_s, message


def scene_messages(
    timed: Sequence[tuple[float, Exchange]],
    joint_names: Sequence[str],
    every: int,
    *,
    cup_turn: Callable[[Array], Array],
    under: str = "/transfer",
) -> Iterator[Message]:
    """Joints (of the whole game only), wrench, cup and ball of every ``every``-th control period, below ``under``.

    ``cup_turn`` gives the cup's rotation (4,) for joint angles.
    """
    for t_s, exchange in timed[::every]:
        state = exchange.state
        if under == "/transfer":
            names = list(joint_names)
            joints = {"names": names, "position_rad": state.position_rad, "velocity_rad_s": state.velocity_rad_s}
            yield f"{under}/joints", t_s, {**joints, "effort_nm": state.effort_nm}
        yield f"{under}/wrench", t_s, wrench_message(state.wrist_wrench)
        cup = {"position_m": state.cup_in_world_m, "rotation_wxyz": cup_turn(state.position_rad)}
        yield f"{under}/cup", t_s, {"parent": "world", "child": "cup", **cup}
        yield f"{under}/ball", t_s, {"parent": "world", "child": "ball", "position_m": state.ball_in_world_m}


def wrench_message(wrench: Array) -> dict[str, float]:
    """The six values of a wrist's sensor under their names."""
    names = (f"{kind}_{axis}_{unit}" for kind, unit in (("force", "n"), ("torque", "nm")) for axis in "xyz")
    return dict(zip(names, wrench.tolist(), strict=True))


def game_messages(game: Game, index: int, start_s: float, horizon_s: float) -> Iterator[Message]:
    """Sightings, images and estimates of one game, and how it ended."""
    watched = game.watched
    for frame in watched.frames:
        seen = frame.sighting
        u_px, v_px = (math.nan, math.nan) if seen is None else seen.centre_px.tolist()
        yield (
            "/transfer/detection",
            start_s + frame.t_s,
            {
                "flight": index,
                "camera": frame.camera,
                "u_px": u_px,
                "v_px": v_px,
                "radius_px": math.nan if seen is None else seen.radius_px,
                "seen": seen is not None,
            },
        )
    for picture in watched.pictures:
        jpeg = cv2.imencode(".jpg", picture.pixels, [cv2.IMWRITE_JPEG_QUALITY, JPEG_QUALITY])[1].tobytes()
        image = {"frame": picture.camera, "format": "jpeg", "data": jpeg}
        yield f"/transfer/image/{picture.camera}", start_s + picture.t_s, image
    for foreseen in game.estimates:
        pose = foreseen.rim
        estimate: dict[str, Any] = {"game": index, "t_catch_s": start_s + pose.t_s, "sigma_t_s": pose.time_sigma_s}
        for axis, name in enumerate("xyz"):
            estimate[f"{name}_m"] = pose.position_m[axis]
            estimate[f"velocity_{name}_m_s"] = pose.velocity_m_s[axis]
        estimate["covariance_m2"] = pose.covariance_m2.ravel()
        yield "/transfer/estimate", start_s + foreseen.t_s, estimate
    error_m = game.prediction_error_m(horizon_s)
    end_s = (game.steps or game.swing.steps)[-1].t_s
    outcome = {
        "index": index,
        "swung_up": game.swung_up,
        "predicted": bool(game.estimates),
        "caught": game.caught,
        "prediction_error_mm": math.nan if error_m is None else 1e3 * error_m,
        "outcome": game.outcome,
        "since_s": math.nan if game.verdict is None else start_s + game.verdict.since_s,
        "free_s": math.nan if watched.free_s is None else start_s + watched.free_s,
        "frames": len(watched.frames),
        "seen": watched.seen,
        "latency_frames": math.nan if watched.latency_frames is None else watched.latency_frames,
        "crossing_s": math.nan if game.crossing is None else start_s + game.crossing.t_s,
        "crossing_m": [] if game.crossing is None else game.crossing.place_m,
        "blow_n": math.nan if game.verdict is None else game.verdict.blow_n,
    }
    yield "/transfer/game", start_s + end_s, outcome
