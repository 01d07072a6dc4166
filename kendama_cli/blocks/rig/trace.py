"""What was done on the robot as log messages: (topic, time, message), thinned out to a wanted period."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from kendama_cli.blocks.rig.catch_game import Game
from kendama_cli.blocks.rig.cup_cart import CartStep
from kendama_cli.blocks.rig.swing_up import Swing
from kendama_cli.blocks.robot.interface import Exchange
from kendama_cli.learning.sarsa import FinishedRollout

Message = tuple[str, float, Mapping[str, Any]]


def step_messages(steps: Sequence[CartStep], rollout: int, start_s: float, every: int) -> Iterator[Message]:
    """/transfer/step of every ``every``-th control period."""
    for step in steps[::every]:
        state = step.state._asdict()
        yield "/transfer/step", start_s + step.t_s, {"rollout": rollout, **state, "action_m_s2": step.acceleration_m_s2}


def rollout_message(topic: str, swing: Swing, finished: FinishedRollout, start_s: float) -> Message:
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
    timed: Sequence[tuple[float, Exchange]], joint_names: Sequence[str], every: int, *, under: str = "/transfer"
) -> Iterator[Message]:
    """Joints (of the whole game only), cup and ball of every ``every``-th control period, below the topic ``under``."""
    for t_s, exchange in timed[::every]:
        state = exchange.state
        if under == "/transfer":
            names = list(joint_names)
            joints = {"names": names, "position_rad": state.position_rad, "velocity_rad_s": state.velocity_rad_s}
            yield f"{under}/joints", t_s, {**joints, "effort_nm": state.effort_nm}
        yield f"{under}/cup", t_s, {"parent": "world", "child": "cup", "position_m": state.cup_in_world_m}
        yield f"{under}/ball", t_s, {"parent": "world", "child": "ball", "position_m": state.ball_in_world_m}


def game_messages(game: Game, index: int, start_s: float, every: int, horizon_s: float) -> Iterator[Message]:
    """/transfer/estimate of every ``every``-th estimate, and /transfer/game at the end."""
    for foreseen in game.estimates[::every]:
        pose = foreseen.pose
        sigma_m = np.sqrt(np.diag(pose.covariance_m2))
        message = {"flight": index, "t_catch_s": start_s + pose.t_s, "sigma_t_s": pose.time_sigma_s}
        for axis, name in enumerate("xyz"):
            message[f"{name}_m"] = pose.position_m[axis]
            message[f"velocity_{name}_m_s"] = pose.velocity_m_s[axis]
            message[f"sigma_{name}_m"] = sigma_m[axis]
        yield "/transfer/estimate", start_s + foreseen.t_s, message
    error_m = game.prediction_error_m(horizon_s)
    end_s = (game.steps or game.swing.steps)[-1].t_s
    outcome = {
        "index": index,
        "swung_up": game.swung_up,
        "predicted": bool(game.estimates),
        "caught": game.caught,
        "prediction_error_mm": float("nan") if error_m is None else 1e3 * error_m,
    }
    yield "/transfer/game", start_s + end_s, outcome
