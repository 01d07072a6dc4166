"""Poses from MCAP files: Foxglove's messages in protobuf or JSON, and ROS 2's in CDR."""

from __future__ import annotations

import json
import struct
from collections.abc import Callable, Collection, Mapping
from importlib import import_module
from pathlib import Path
from typing import Any

from foxglove_schemas_protobuf.FrameTransform_pb2 import FrameTransform
from foxglove_schemas_protobuf.FrameTransforms_pb2 import FrameTransforms
from foxglove_schemas_protobuf.PoseInFrame_pb2 import PoseInFrame
from google.protobuf import json_format
from google.protobuf.message import DecodeError, Message
from google.protobuf.timestamp_pb2 import Timestamp

from kendama_cli.devices.recordings.body_track import BodyTrack
from kendama_cli.devices.recordings.poses import OF_FOXGLOVE, OF_ROS, Pose, PoseTrack, PoseTracks
from kendama_cli.errors import InputError, MissingPartError, install_line
from kendama_cli.log.container import REMEDY, ChannelContent
from kendama_cli.log.reader import LogFile

PROTOBUF: Mapping[str, type[Message]] = {
    "foxglove.FrameTransform": FrameTransform,
    "foxglove.FrameTransforms": FrameTransforms,
    "foxglove.PoseInFrame": PoseInFrame,
}
HOLDS_POSES = frozenset(
    {(name, encoding) for name in OF_FOXGLOVE for encoding in ("protobuf", "json")}
    | {(name, encoding) for name in OF_ROS for encoding in ("cdr", "ros1")}
)
"""Schemas with the encodings in which they are read."""


def ros_2_name(schema: str) -> str:
    """Return a schema's name as ROS 2 writes it, with ``/msg/``: a bag of ROS 1 that became an MCAP is without."""
    return schema.replace("/", "/msg/") if schema.count("/") == 1 else schema


def pose_topics(channels: list[dict[str, Any]]) -> list[str]:
    """Return the topics among ``LogFile.describe``'s channels that have messages with poses, sorted."""
    return sorted(
        {
            one["topic"]
            for one in channels
            if one["messages"] and (ros_2_name(one["schema"]), one["encoding"]) in HOLDS_POSES
        }
    )


def listed(channels: list[dict[str, Any]]) -> str:
    """List a file's topics for an error, with schema and number of messages."""
    filled = [one for one in channels if one["messages"]]
    return ", ".join(f"{one['topic']} ({one['schema']}, {one['messages']})" for one in filled) or "no messages"


def read_pose_tracks(path: str, topics: Collection[str]) -> list[PoseTrack]:
    """Read the tracks on ``topics``; raises InputError for a file or a message that is damaged."""
    return _gathered(path, topics).tracks()


def read_mcap_bodies(path: str) -> list[BodyTrack]:
    """Read a body per topic and child frame; raises InputError for a damaged file, and for one without poses."""
    channels = LogFile(path, topics=()).describe()["channels"]
    topics = pose_topics(channels)
    if not topics:
        names = ", ".join([*OF_FOXGLOVE, *OF_ROS])
        raise InputError(path, f"no poses or transforms; it has {listed(channels)}", remedy=f"log one of {names}")
    return _gathered(path, topics).bodies()


def _gathered(path: str, topics: Collection[str]) -> PoseTracks:
    found, log = PoseTracks(), LogFile(path, topics)
    for topic in topics:
        channel = log.channel(topic)
        read = _reader(path, channel)
        for number, (log_ns, data) in enumerate(channel.messages, start=1):
            try:
                poses = read(data)
            except (DecodeError, json_format.ParseError, ValueError, TypeError, KeyError, struct.error):
                problem = f"a message that is no {channel.schema_name}"
                raise InputError(path, problem, where=f"message {number} of {topic}", remedy=REMEDY) from None
            found.add(topic, number, log_ns, poses)
    return found


def _reader(path: str, channel: ChannelContent) -> Callable[[bytes], list[Pose]]:
    name = ros_2_name(channel.schema_name)
    if channel.encoding in ("cdr", "ros1"):
        decoded = ros_decoder(Path(path), channel.encoding)
        return lambda data: OF_ROS[name](decoded(data, name))
    made = PROTOBUF[name]
    if channel.encoding == "json":
        return lambda data: OF_FOXGLOVE[name](_from_json(data, made()))
    return lambda data: OF_FOXGLOVE[name](made.FromString(data))


def _from_json(data: bytes, empty: Message) -> Message:
    return json_format.ParseDict(_stamped(json.loads(data)), empty, ignore_unknown_fields=True)


def _stamped(value: Any) -> Any:
    """Return Foxglove's JSON with its time stamps (sec, nsec) as protobuf's JSON has them."""
    if isinstance(value, list):
        return [_stamped(one) for one in value]
    if not isinstance(value, dict):
        return value
    if value.keys() == {"sec", "nsec"}:
        stamp = Timestamp(seconds=int(value["sec"]), nanos=int(value["nsec"]))
        return stamp.ToJsonString()
    return {key: _stamped(one) for key, one in value.items()}


def ros_types(path: Path, version: int = 2) -> Any:
    """Return the store of the message types of ROS 1 or 2; raises MissingPartError without ``rosbags``."""
    typesys = rosbags(path, "rosbags.typesys")
    return typesys.get_typestore(typesys.Stores.ROS2_HUMBLE if version == 2 else typesys.Stores.ROS1_NOETIC)


def ros_decoder(path: Path, encoding: str) -> Callable[[bytes, str], Any]:
    """Return what makes a message of a named type of ``cdr`` (ROS 2) or ``ros1``, and raises ValueError otherwise."""
    store = ros_types(path, 2 if encoding == "cdr" else 1)
    read = store.deserialize_cdr if encoding == "cdr" else store.deserialize_ros1
    wrong = rosbags(path, "rosbags.serde").SerdeError

    def decoded(data: bytes, kind: str) -> Any:
        try:
            return read(data, kind)
        except (wrong, AssertionError, IndexError) as damaged:
            raise ValueError(str(damaged)) from None

    return decoded


def rosbags(path: Path, module: str) -> Any:
    try:
        return import_module(module)
    except ImportError:
        raise MissingPartError(
            "rosbags", f"{path}: reading messages of ROS needs the library rosbags: {install_line('ros')}"
        ) from None
