"""Tracks from bags of ROS 1 and 2."""

from __future__ import annotations

import contextlib
import sys
from collections.abc import Iterator
from pathlib import Path

from kendama_cli.devices.recordings.body_track import BodyTrack
from kendama_cli.devices.recordings.mcap_poses import ros_types, rosbags
from kendama_cli.devices.recordings.poses import OF_ROS, PoseTracks
from kendama_cli.errors import InputError

MOST_BYTES = 700 << 20


def read_bag(path: Path) -> list[BodyTrack]:
    """Read a track per topic, and per child frame of transforms, by the messages' own stamps.

    Raises MissingPartError without ``rosbags``, InputError for what is no bag or holds no poses.
    """
    highlevel, store = rosbags(path, "rosbags.highlevel"), ros_types(path)
    path = path.parent if path.name == "metadata.yaml" else path
    found = PoseTracks()
    topics: dict[str, str] = {}
    try:
        with bounded(), highlevel.AnyReader([path], default_typestore=store) as bag:
            topics = {one.topic: f"{one.msgtype}, {one.msgcount}" for one in bag.connections}
            chosen = [one for one in bag.connections if one.msgtype in OF_ROS]
            # no connections would mean all of them
            messages = bag.messages(connections=chosen) if chosen else ()
            for number, (link, log_ns, data) in enumerate(messages, start=1):
                poses = OF_ROS[str(link.msgtype)](bag.deserialize(data, link.msgtype))
                found.add(link.topic, number, log_ns, poses)
    except (highlevel.AnyReaderError, OSError, ValueError, KeyError, AssertionError, MemoryError, RuntimeError) as bad:
        problem = f"cannot be read as a ROS bag ({str(bad) or type(bad).__name__})"
        raise InputError(str(path), problem, remedy="record it again") from None
    bodies = found.bodies()
    if not bodies:
        listed = ", ".join(f"{topic} ({kind})" for topic, kind in sorted(topics.items())) or "none"
        raise InputError(
            str(path), f"no poses or transforms; its topics: {listed}", remedy=f"record one of {', '.join(OF_ROS)}"
        )
    return bodies


@contextlib.contextmanager
def bounded(more_bytes: int = MOST_BYTES) -> Iterator[None]:
    """Have memory beyond ``more_bytes`` raise MemoryError meanwhile, and a file beyond them OSError; on Linux only."""
    if sys.platform != "linux":
        yield
        return
    import resource  # noqa: PLC0415 - on Unix only

    used = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
    before = [(kind, *resource.getrlimit(kind)) for kind in (resource.RLIMIT_AS, resource.RLIMIT_FSIZE)]
    try:
        for (kind, soft, hard), most in zip(before, (used + more_bytes, more_bytes), strict=True):
            resource.setrlimit(kind, (most if soft == resource.RLIM_INFINITY else min(soft, most), hard))
        yield
    finally:
        for kind, soft, hard in before:
            resource.setrlimit(kind, (soft, hard))
