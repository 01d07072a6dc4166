"""Poses from ROS 1 and ROS 2 bags, the MCAP files of ROS 2 among them, through ``rosbags``."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np

from kendama_cli.devices.hand.tracks.body_track import BodyTrack
from kendama_cli.errors import InputError, MissingPartError

KNOWN: Mapping[str, Callable[[Any], list[tuple[str, Any, Any, Any]]]] = {
    "geometry_msgs/msg/PoseStamped": lambda m: [("", m.header, m.pose.position, m.pose.orientation)],
    "geometry_msgs/msg/PoseWithCovarianceStamped": lambda m: [
        ("", m.header, m.pose.pose.position, m.pose.pose.orientation)
    ],
    "nav_msgs/msg/Odometry": lambda m: [("", m.header, m.pose.pose.position, m.pose.pose.orientation)],
    "geometry_msgs/msg/TransformStamped": lambda m: [_transform(m)],
    "tf2_msgs/msg/TFMessage": lambda m: [_transform(one) for one in m.transforms],
    "geometry_msgs/msg/PointStamped": lambda m: [("", m.header, m.point, None)],
}
"""Message types, and what they hold: child frame, header, place, orientation."""


def read_bag(path: Path) -> list[BodyTrack]:
    """A track per topic, and per child frame of transforms, by the messages' own stamps.

    Raises MissingPartError without ``rosbags``, InputError for what is no bag or holds no poses.
    """
    try:
        highlevel, typesys = import_module("rosbags.highlevel"), import_module("rosbags.typesys")
    except ImportError:
        raise MissingPartError(
            "rosbags", f"{path}: reading ROS bags needs the library rosbags: pip install 'kendama[ros]'"
        ) from None
    rows: dict[str, list[tuple[float, ...]]] = {}
    topics: dict[str, str] = {}
    try:
        with highlevel.AnyReader([path], default_typestore=typesys.get_typestore(typesys.Stores.ROS2_HUMBLE)) as bag:
            topics = {one.topic: str(one.msgtype) for one in bag.connections}
            chosen = [one for one in bag.connections if one.msgtype in KNOWN]
            for link, stamp_ns, data in bag.messages(connections=chosen):
                for name, row in _rows(link.topic, str(link.msgtype), stamp_ns, bag.deserialize(data, link.msgtype)):
                    rows.setdefault(name, []).append(row)
    except (highlevel.AnyReaderError, OSError, ValueError, KeyError, AssertionError) as wrong:
        raise InputError(str(path), f"cannot be read as a ROS bag ({wrong})", remedy="record it again") from None
    if not rows:
        listed = ", ".join(f"{topic} ({kind})" for topic, kind in sorted(topics.items())) or "none"
        raise InputError(
            str(path), f"no poses or transforms; its topics: {listed}", remedy=f"record one of {', '.join(KNOWN)}"
        )
    tracks = []
    for name, values in rows.items():
        table = np.array(sorted(values))
        _, first = np.unique(table[:, 0], return_index=True)
        table = table[first]
        turned = table[:, 4:] if np.isfinite(table[:, 4:]).all() else None
        tracks.append(BodyTrack(name, table[:, 0] - table[0, 0], table[:, 1:4], turned))
    return tracks


def _rows(topic: str, kind: str, stamp_ns: int, message: Any) -> Iterator[tuple[str, tuple[float, ...]]]:
    for child, header, place, turn in KNOWN[kind](message):
        own_s = header.stamp.sec + 1e-9 * header.stamp.nanosec
        q = (np.nan,) * 4 if turn is None else (turn.w, turn.x, turn.y, turn.z)
        yield f"{topic} {child}".strip(), (own_s or 1e-9 * stamp_ns, place.x, place.y, place.z, *q)


def _transform(one: Any) -> tuple[str, Any, Any, Any]:
    return one.child_frame_id, one.header, one.transform.translation, one.transform.rotation
