"""Episodes for others to learn from: every full game of transfer, in the joints of the arm that played it."""

from __future__ import annotations

import numpy as np

from kendama_cli.log.episode import Episode, Episodes
from kendama_cli.log.messages import JointExchangeMessage
from kendama_cli.log.reader import TypedMessages
from kendama_cli.motion.sampling import columns_at
from kendama_cli.report.source import StageLog
from kendama_cli.report.tracks import Array
from kendama_cli.schema.foxglove import FrameTransform
from kendama_cli.stages.transfer.messages import GameMessage, TransferStepMessage

_SCENE = ("cup", "ball")


def episodes(log: StageLog, fps: int) -> Episodes | None:
    """Return measured angles, velocities, cup and ball; the action is the angles commanded one frame later."""
    games = log.messages("/transfer/game", GameMessage)
    exchanges = log.messages("/transfer/exchange", JointExchangeMessage)
    if not len(games) or not len(exchanges):
        return None
    steps = log.table("/transfer/step", TransferStepMessage)
    scene_s, scene_m = _scene(log)
    joints = tuple(exchanges.messages[0].joints)
    found = []
    for end_s, game in zip(games.t_s.tolist(), games.messages, strict=True):
        start_s = float(steps["t_s"][steps["rollout"] == -1 - game.index].min())
        frames_s = start_s + np.arange(int((end_s - start_s) * fps + 1e-6) + 1) / fps
        first, last = np.searchsorted(exchanges.t_s, [start_s, end_s + 1e-9])
        played = TypedMessages(exchanges.t_s[first:last], exchanges.messages[first:last])
        measured = [_at(frames_s, played, field) for field in ("measured_rad", "measured_rad_s")]
        vectors = {"observation.state": np.hstack(measured), "action": _at(frames_s + 1 / fps, played, "sent_rad")}
        if np.isfinite(scene_m).all():  # an arm that does not see the ball itself does not tell where it is
            vectors["observation.environment_state"] = columns_at(frames_s, scene_s, scene_m)
        found.append(Episode(vectors, success=game.caught))
    names = {
        "observation.state": [f"{joint}.{what}" for what in ("pos_rad", "vel_rad_s") for joint in joints],
        "action": [f"{joint}.pos_rad" for joint in joints],
        "observation.environment_state": [f"{body}.{axis}_m" for body in _SCENE for axis in "xyz"],
    }
    return Episodes("arm", "swing the ball up and catch it in the cup", fps, names, tuple(found))


def _scene(log: StageLog) -> tuple[Array, Array]:
    """Return the times (n,) and positions (n, 6) of cup and ball."""
    paths = [log.table(f"/transfer/{body}", FrameTransform) for body in _SCENE]
    return paths[0]["t_s"].to_numpy(np.float64), np.hstack(
        [path[["x_m", "y_m", "z_m"]].to_numpy(np.float64) for path in paths]
    )


def _at(t_s: Array, played: TypedMessages[JointExchangeMessage], field: str) -> Array:
    return columns_at(t_s, played.t_s, np.array([getattr(one, field) for one in played.messages], dtype=np.float64))
