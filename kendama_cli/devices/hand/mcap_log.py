"""Reading recordings from MCAP: transforms of the cup, as an earlier capture or another program logged them."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from foxglove_schemas_protobuf.FrameTransform_pb2 import FrameTransform
from google.protobuf.message import DecodeError

from kendama_cli.devices.hand.recording import Recording, unit_rotations
from kendama_cli.devices.hand.settings import FileCapture
from kendama_cli.errors import InputError
from kendama_cli.log.container import REMEDY
from kendama_cli.log.reader import LogFile

SCHEMA = "foxglove.FrameTransform"
USUAL_TOPIC = "/capture/cup"
UPRIGHT = (1.0, 0.0, 0.0, 0.0)


@dataclass
class _Track:
    """The samples of one child frame, and how many messages of the topic came before each."""

    t_ns: list[int] = field(default_factory=list)
    position_m: list[tuple[float, float, float]] = field(default_factory=list)
    message: list[int] = field(default_factory=list)
    rotation_wxyz: list[tuple[float, float, float, float]] = field(default_factory=list)


def read_mcap(path: str, settings: FileCapture) -> list[Recording]:
    """The recordings in the MCAP file ``path``, one per child frame of the topic.

    Raises InputError for a file that is cut short or damaged (every byte is checked), and for one without the topic.
    """
    topic = _topic(path, LogFile(path, topics=()).describe()["channels"], settings.topic)
    tracks: dict[str, _Track] = {}
    for number, (log_ns, data) in enumerate(LogFile(path, (topic,)).channel(topic).messages, start=1):
        try:
            transform = FrameTransform.FromString(data)
        except DecodeError:
            problem = f"a message that is no {SCHEMA}"
            raise InputError(path, problem, where=f"message {number} of {topic}", remedy=REMEDY) from None
        track = tracks.setdefault(transform.child_frame_id, _Track())
        # a producer that leaves the time stamp out means the time of the log
        track.t_ns.append(transform.timestamp.ToNanoseconds() if transform.HasField("timestamp") else log_ns)
        at = transform.translation
        track.position_m.append((at.x, at.y, at.z))
        track.message.append(number)
        turn = transform.rotation
        # a producer that leaves the rotation out means none
        track.rotation_wxyz.append((turn.w, turn.x, turn.y, turn.z) if transform.HasField("rotation") else UPRIGHT)
    if settings.child is not None:
        if settings.child not in tracks:
            listed = ", ".join(f"'{child}'" for child in tracks)
            problem = f"no child frame '{settings.child}' on {topic}; it has {listed}"
            raise InputError(path, problem, remedy="set capture.child to one of them")
        tracks = {settings.child: tracks[settings.child]}
    from_start = settings.rotation.upright == "start"
    return [_recording(path, topic, child, track, from_start) for child, track in tracks.items()]


def _recording(path: str, topic: str, child: str, track: _Track, from_start: bool) -> Recording:
    t_ns = np.array(track.t_ns, dtype=np.int64)
    numbers = list(track.message)

    def place(sample: int) -> str:
        return f"message {numbers[sample]} of {topic}"

    turned = any(rotation != UPRIGHT for rotation in track.rotation_wxyz)
    rotation = np.array(track.rotation_wxyz)
    return Recording(
        path,
        child or Path(path).stem,
        (t_ns - t_ns[0]) * 1e-9,
        np.array(track.position_m),
        place,
        f"look at capture.topic and have {SCHEMA} written in metres, as it is defined",
        "have the transforms written in a frame whose z points up and whose x lies in the swing's plane",
        rotation_wxyz=unit_rotations(path, rotation, place, from_start=from_start) if turned else None,
    )


def _topic(path: str, channels: list[dict[str, Any]], wanted: str | None) -> str:
    filled = [channel for channel in channels if channel["messages"]]
    fitting = sorted({str(channel["topic"]) for channel in filled if channel["schema"] == SCHEMA})
    if wanted is None and len(fitting) == 1:
        return fitting[0]
    choice = wanted or USUAL_TOPIC
    if choice in fitting:
        return choice
    listed = ", ".join(f"{channel['topic']} ({channel['schema']}, {channel['messages']})" for channel in filled)
    problem = f"no messages of {SCHEMA} on the topic '{choice}'; it has {listed or 'no messages'}"
    raise InputError(path, problem, remedy="set capture.topic to a topic with the cup's transforms")
