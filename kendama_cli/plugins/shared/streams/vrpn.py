"""VRPN (github vrpn/vrpn, version 7): messages as bytes, and bytes as messages.

Both ends greet with a cookie of 24 bytes. Then messages: a header of 24 bytes (length without the padding at the end,
seconds, microseconds, sender, type, sequence number; big-endian 32-bit), and content padded to 8 bytes. Senders and
types are numbers of the one who sends, which messages of the types -1 and -2 give names. A tracker's ``Pos_Quat`` is
its sensor's number twice, then seven 64-bit floats: the position (by convention in m) and a quaternion, its real part
last. A client that does not offer a UDP port gets all reports by TCP.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator
from dataclasses import dataclass

COOKIE_SIZE = 24
MAJOR = b"vrpn: ver. 07."
COOKIE = (MAJOR + b"38  0").ljust(COOKIE_SIZE, b"\0")
HEADER = struct.Struct(">IIIiiI")
NAME = struct.Struct(">I")
POSE = struct.Struct(">ii7d")
SENDER, TYPE = -1, -2
POSE_TYPE = "vrpn_Tracker Pos_Quat"
ALIGN = 8
MAX_BYTES = 1 << 20


@dataclass(frozen=True)
class Message:
    """One message by the names of its type and sender, and the server's stamp."""

    kind: str
    sender: str
    stamp_s: float
    content: bytes


@dataclass(frozen=True)
class TrackerReport:
    """One sensor's pose: position (3,) and quaternion wxyz (4,), by the server's stamp."""

    tracker: str
    sensor: int
    stamp_s: float
    position: tuple[float, float, float]
    rotation_wxyz: tuple[float, float, float, float]


class VrpnStream:
    """Takes bytes as they come, and yields the messages among them whose types have names."""

    def __init__(self) -> None:
        self._pending = bytearray()
        self._greeted = False
        self._names: dict[tuple[int, int], str] = {}

    def feed(self, data: bytes) -> Iterator[Message]:
        """Yield the messages that ``data`` completes; raises ValueError for what is not VRPN 7, or damaged."""
        self._pending += data
        if not self._greeted:
            if not MAJOR.startswith(self._pending[: len(MAJOR)]):
                raise ValueError(f"does not speak VRPN 7 (it greets with {bytes(self._pending[:COOKIE_SIZE])!r})")
            if len(self._pending) < COOKIE_SIZE:
                return
            del self._pending[:COOKIE_SIZE]
            self._greeted = True
        while len(self._pending) >= HEADER.size:
            length, seconds, micros, sender, kind, _ = HEADER.unpack_from(self._pending)
            if not HEADER.size <= length <= MAX_BYTES:
                raise ValueError(f"sent a message of {length} bytes, which is no VRPN")
            whole = -(-length // ALIGN) * ALIGN
            if len(self._pending) < whole:
                return
            content = bytes(self._pending[HEADER.size : length])
            del self._pending[:whole]
            if kind in (SENDER, TYPE):  # then ``sender`` is the number that is named
                self._names[kind, sender] = content[NAME.size :].split(b"\0")[0].decode("utf-8", "replace")
            elif (name := self._names.get((TYPE, kind))) is not None:
                who = self._names.get((SENDER, sender), f"sender {sender}")
                yield Message(name, who, seconds + 1e-6 * micros, content)


def tracker_report(message: Message) -> TrackerReport | None:
    """Return a tracker's pose, None for another message; raises ValueError for one of another length."""
    if message.kind != POSE_TYPE:
        return None
    if len(message.content) != POSE.size:
        raise ValueError(f"sent a pose of {len(message.content)} bytes, not {POSE.size}")
    sensor, _, x, y, z, qx, qy, qz, qw = POSE.unpack(message.content)
    return TrackerReport(message.sender, sensor, message.stamp_s, (x, y, z), (qw, qx, qy, qz))


def named(kind: int, number: int, name: str) -> bytes:
    """Return the message that names our sender or type of this number."""
    text = name.encode() + b"\0"
    return message_bytes(number, kind, NAME.pack(len(text)) + text)


def message_bytes(sender: int, kind: int, content: bytes) -> bytes:
    """Return a message without a time."""
    return HEADER.pack(HEADER.size + len(content), 0, 0, sender, kind, 0) + content + bytes(-len(content) % ALIGN)
