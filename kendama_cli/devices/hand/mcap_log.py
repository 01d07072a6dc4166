"""Reading demonstrations from MCAP: poses of the cup, as an earlier capture, a ROS 2 system or Foxglove logged them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from kendama_cli.devices.hand.recording import Recording, unit_rotations
from kendama_cli.devices.hand.settings import FileCapture
from kendama_cli.devices.hand.tracks.mcap_poses import listed, pose_topics, read_pose_tracks
from kendama_cli.devices.hand.tracks.poses import PoseTrack
from kendama_cli.errors import InputError
from kendama_cli.log.reader import LogFile
from kendama_cli.schema.foxglove import UPRIGHT_WXYZ

USUAL_TOPIC = "/capture/cup"


def read_mcap(path: str, settings: FileCapture) -> list[Recording]:
    """The recordings in the MCAP file ``path``, one per child frame of the topic.

    Raises InputError for a file that is cut short or damaged (every byte is checked), and for one without the topic.
    """
    topic = _topic(path, LogFile(path, topics=()).describe()["channels"], settings.topic)
    tracks = read_pose_tracks(path, (topic,))
    if settings.child is not None:
        chosen = [track for track in tracks if track.child == settings.child]
        if not chosen:
            named = ", ".join(f"'{track.child}'" for track in tracks)
            problem = f"no child frame '{settings.child}' on {topic}; it has {named}"
            raise InputError(path, problem, remedy="set capture.child to one of them")
        tracks = chosen
    from_start = settings.rotation.upright == "start"
    return [_recording(path, track, from_start) for track in tracks]


def _recording(path: str, track: PoseTrack, from_start: bool) -> Recording:
    t_ns = track.t_ns()

    def place(sample: int) -> str:
        return f"message {track.number[sample]} of {track.topic}"

    rotation = track.rotation_wxyz()
    if rotation is not None and (rotation == UPRIGHT_WXYZ).all():
        rotation = None
    return Recording(
        path,
        track.child or Path(path).stem,
        (t_ns - t_ns[0]) * 1e-9,
        np.array(track.position_m, dtype=np.float64),
        place,
        "look at capture.topic and have the poses logged in metres, as they are defined",
        "have the poses logged in a frame whose z points up and whose x lies in the swing's plane, or read them with "
        "capture=body and capture.axes",
        rotation_wxyz=None if rotation is None else unit_rotations(path, rotation, place, from_start=from_start),
    )


def _topic(path: str, channels: list[dict[str, Any]], wanted: str | None) -> str:
    fitting = pose_topics(channels)
    if wanted is None and len(fitting) == 1:
        return fitting[0]
    choice = wanted or USUAL_TOPIC
    if choice in fitting:
        return choice
    problem = f"no poses or transforms on the topic '{choice}'; it has {listed(channels)}"
    raise InputError(path, problem, remedy="set capture.topic to a topic with the cup's poses")
