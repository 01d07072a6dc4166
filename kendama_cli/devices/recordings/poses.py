"""Poses as the messages of ROS and Foxglove hold them, gathered into tracks."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from kendama_cli.devices.recordings.body_track import BodyTrack
from kendama_cli.schema.arrays import Array
from kendama_cli.schema.foxglove import UPRIGHT_WXYZ


@dataclass(frozen=True)
class Pose:
    """A frame, or a point (``rotation_wxyz`` None), in another frame; ``stamp_ns`` is 0 where the sender gave none."""

    frame: str
    child: str
    stamp_ns: int
    position_m: tuple[float, float, float]
    rotation_wxyz: tuple[float, float, float, float] | None


def _of_ros(header: Any, child: str, place: Any, turn: Any) -> Pose:
    stamp_ns = header.stamp.sec * 10**9 + header.stamp.nanosec
    rotation = None if turn is None else (turn.w, turn.x, turn.y, turn.z)
    return Pose(header.frame_id, child, stamp_ns, (place.x, place.y, place.z), rotation)


def _ros_pose(header: Any, pose: Any) -> list[Pose]:
    return [_of_ros(header, "", pose.position, pose.orientation)]


def _ros_transform(one: Any) -> Pose:
    return _of_ros(one.header, one.child_frame_id, one.transform.translation, one.transform.rotation)


def _of_foxglove(frame: str, child: str, message: Any, place: Any, turn: Any) -> Pose:
    """Return the pose in a message of Foxglove; a sender that leaves a rotation out means none."""
    stamp = message.timestamp
    stamp_ns = stamp.seconds * 10**9 + stamp.nanos
    rotation = UPRIGHT_WXYZ if turn is None else (turn.w, turn.x, turn.y, turn.z)
    return Pose(frame, child, stamp_ns, (place.x, place.y, place.z), rotation)


def _foxglove_transform(one: Any) -> Pose:
    turn = one.rotation if one.HasField("rotation") else None
    return _of_foxglove(one.parent_frame_id, one.child_frame_id, one, one.translation, turn)


def _foxglove_pose(one: Any) -> Pose:
    turn = one.pose.orientation if one.pose.HasField("orientation") else None
    return _of_foxglove(one.frame_id, "", one, one.pose.position, turn)


OF_ROS: Mapping[str, Callable[[Any], list[Pose]]] = {
    "geometry_msgs/msg/PoseStamped": lambda m: _ros_pose(m.header, m.pose),
    "geometry_msgs/msg/PoseWithCovarianceStamped": lambda m: _ros_pose(m.header, m.pose.pose),
    "nav_msgs/msg/Odometry": lambda m: _ros_pose(m.header, m.pose.pose),
    "geometry_msgs/msg/TransformStamped": lambda m: [_ros_transform(m)],
    "tf2_msgs/msg/TFMessage": lambda m: [_ros_transform(one) for one in m.transforms],
    "geometry_msgs/msg/PointStamped": lambda m: [_of_ros(m.header, "", m.point, None)],
}
"""ROS' message types that hold poses or points, and what they hold."""

OF_FOXGLOVE: Mapping[str, Callable[[Any], list[Pose]]] = {
    "foxglove.FrameTransform": lambda m: [_foxglove_transform(m)],
    "foxglove.FrameTransforms": lambda m: [_foxglove_transform(one) for one in m.transforms],
    "foxglove.PoseInFrame": lambda m: [_foxglove_pose(m)],
}
"""The same for Foxglove's, as protobuf."""


@dataclass
class PoseTrack:
    """The poses of one child frame in one frame on one topic, in the order of the file; ``number`` is the message's."""

    topic: str
    frame: str
    child: str
    stamp_ns: list[int] = field(default_factory=list)
    log_ns: list[int] = field(default_factory=list)
    number: list[int] = field(default_factory=list)
    position_m: list[tuple[float, float, float]] = field(default_factory=list)
    rotations: list[tuple[float, float, float, float] | None] = field(default_factory=list)

    def t_ns(self) -> NDArray[np.int64]:
        """Return the senders' stamps (n,), or the times of the log if no message has one."""
        return np.array(self.stamp_ns if any(self.stamp_ns) else self.log_ns, dtype=np.int64)

    def rotation_wxyz(self) -> Array | None:
        """Return the rotations (n, 4), None for points."""
        known = [one for one in self.rotations if one is not None]
        return np.array(known, dtype=np.float64) if known else None


class PoseTracks:
    """Tracks as they grow, message by message."""

    def __init__(self) -> None:
        self._tracks: dict[tuple[str, str, str], PoseTrack] = {}

    def add(self, topic: str, number: int, log_ns: int, poses: Sequence[Pose]) -> None:
        """Add the poses of message ``number`` of ``topic``."""
        for one in poses:
            key = (topic, one.frame, one.child)
            track = self._tracks.setdefault(key, PoseTrack(*key))
            track.stamp_ns.append(one.stamp_ns)
            track.log_ns.append(log_ns)
            track.number.append(number)
            track.position_m.append(one.position_m)
            track.rotations.append(one.rotation_wxyz)

    def tracks(self) -> list[PoseTrack]:
        """Return all tracks, the first to come first."""
        return list(self._tracks.values())

    def bodies(self) -> list[BodyTrack]:
        """Return a body per track, in the order of time, named by topic and child, and frame if it has several."""
        called = [f"{one.topic} {one.child}".strip() for one in self.tracks()]
        return [
            _body(f"{name} in {one.frame}" if called.count(name) > 1 else name, one)
            for name, one in zip(called, self.tracks(), strict=True)
        ]


def _body(name: str, track: PoseTrack) -> BodyTrack:
    t_ns = track.t_ns()
    order = np.argsort(t_ns, kind="stable")
    turned = track.rotation_wxyz()
    return BodyTrack(
        name,
        (t_ns[order] - t_ns.min()) * 1e-9,
        np.array(track.position_m, dtype=np.float64)[order],
        None if turned is None else turned[order],
    )
