"""Episodes for other learners from the log of capture: each demonstration, the cup's pose and the next one."""

from __future__ import annotations

import numpy as np

from kendama_cli.log.episode import Episode, Episodes
from kendama_cli.report.replay.performance import poses_between, poses_of
from kendama_cli.report.source import StageLog
from kendama_cli.schema.foxglove import UPRIGHT_WXYZ, FrameTransform

_POSE = ("cup.x_m", "cup.y_m", "cup.z_m", "cup.qw", "cup.qx", "cup.qy", "cup.qz")


def episodes(log: StageLog, fps: int) -> Episodes | None:
    """Return the hand of a person that holds the cup: its pose, and as action its pose one frame later.

    Where no swing has an orientation, four constant columns would say that the cup was upright: they are left out.
    """
    found = []
    for _, one in log.table("/capture/cup", FrameTransform).groupby("child", sort=True):
        t_s = one["t_s"].to_numpy(np.float64)
        frames_s = t_s[0] + np.arange(int(np.ptp(t_s) * fps + 1e-6) + 1) / fps
        found.append(poses_between(t_s, poses_of(one), frames_s))
    if not found:
        return None
    turned = any((poses[:, 3:] != UPRIGHT_WXYZ).any() for poses in found)
    names = _POSE if turned else _POSE[:3]
    made = tuple(
        Episode({"observation.state": poses[:, : len(names)], "action": following[:, : len(names)]})
        for poses, following in ((one, np.vstack([one[1:], one[-1:]])) for one in found)
    )
    columns = {"observation.state": names, "action": names}
    return Episodes("hand", "swing the ball up and catch it in the cup", fps, columns, made)
