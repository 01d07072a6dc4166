"""Sealed messages over TCP: the session of the robot's line (devices/robot/udp/seal.py), for images.

A message is its length (u32) and a datagram of that line. A session begins with HELLO, CHALLENGE, OPEN, WELCOME; the
last names the cameras (JSON). From then on COMMAND asks for an image, and STATE, twice, brings what is known of it and
then its pixels under the counter of what they answer; WORKING says that there is none yet, STOPPED why there is none.
"""

from __future__ import annotations

import socket
import struct
import time
from contextlib import suppress
from dataclasses import dataclass

from kendama_cli.devices.robot.udp.protocol import Datagram, Kind
from kendama_cli.devices.robot.udp.seal import ForeignDatagramError, Seal

_LENGTH = struct.Struct("<I")
GREETING_BYTES = 256
"""A greeting is no longer; more is not read of anybody who has not shown the key."""
IMAGE_BYTES = 1 << 27
"""An image is no longer; of no message more is read."""
_REQUEST = struct.Struct("<HBd4i")
_HEAD = struct.Struct("<dddB4i")


class LineError(Exception):
    """The line ended, fell silent, or brought something else than was due, which the text names."""


@dataclass(frozen=True)
class Request:
    """Request for a frame of ``camera`` newer than ``after_s``; only its ``region`` (left, top, right, bottom)."""

    camera: int
    quality: int
    """JPEG quality; 0 for unchanged pixels"""
    after_s: float
    region: tuple[int, int, int, int]

    def pack(self) -> bytes:
        return _REQUEST.pack(self.camera, self.quality, self.after_s, *self.region)

    @staticmethod
    def unpack(data: bytes) -> Request:
        """Raise LineError where ``data`` is none."""
        if len(data) != _REQUEST.size:
            raise LineError("a request of another size came")
        camera, quality, after_s, *region = _REQUEST.unpack(data)
        return Request(camera, quality, after_s, tuple(region))


@dataclass(frozen=True)
class FrameHead:
    """Times on the server's clock of the request's arrival, of this answer, and of mid-exposure; the pixels' form."""

    received_s: float
    sent_s: float
    t_s: float
    jpeg: bool
    box: tuple[int, int, int, int]
    """Left, top, width, height of the pixels in the image"""

    def pack(self) -> bytes:
        return _HEAD.pack(self.received_s, self.sent_s, self.t_s, self.jpeg, *self.box)

    @staticmethod
    def unpack(data: bytes) -> FrameHead:
        """Raise LineError where ``data`` is none."""
        if len(data) != _HEAD.size:
            raise LineError("an answer of another size came")
        received_s, sent_s, t_s, jpeg, *box = _HEAD.unpack(data)
        return FrameHead(received_s, sent_s, t_s, bool(jpeg), tuple(box))


class SealedLine:
    """Messages of one session over a connected socket; every fault of the line raises LineError."""

    def __init__(self, line: socket.socket, seal: Seal) -> None:
        self._line, self.seal = line, seal
        self.session = 0
        self.arrived_s = 0.0
        """Monotonic time at which the newest message began to arrive"""
        line.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)

    def pack(self, kind: Kind, counter: int, payload: bytes = b"") -> bytes:
        """Pack a message for ``send``."""
        sealed = self.seal.pack(Datagram(kind, self.session, counter, payload))
        return _LENGTH.pack(len(sealed)) + sealed

    def send(self, data: bytes) -> None:
        try:
            self._line.sendall(data)
        except OSError as error:
            raise LineError(f"the line cannot be written to: {error}") from None

    def receive(self, *kinds: Kind, counter: int | None, at_most: int = GREETING_BYTES) -> Datagram:
        """Return the next message, one of ``kinds`` under ``counter`` (None: any)."""
        head = self._read(_LENGTH.size)
        self.arrived_s = time.monotonic()
        (length,) = _LENGTH.unpack(head)
        if length > at_most:
            raise LineError("a message is too long, or no message of this line")
        try:
            found = self.seal.unpack(self._read(length))
        except ForeignDatagramError:
            raise LineError("a message is not under the key; has the other end the same key?") from None
        if found.kind not in kinds or found.session != self.session or counter not in (None, found.counter):
            raise LineError(f"{found.kind.name} {found.counter} came where {kinds[0].name} was due")
        return found

    def close(self) -> None:
        with suppress(OSError):
            self._line.shutdown(socket.SHUT_RDWR)
        self._line.close()

    def _read(self, count: int) -> bytes:
        data = bytearray()
        while len(data) < count:
            try:
                part = self._line.recv(min(count - len(data), 1 << 20))
            except OSError as error:
                raise LineError("nothing came in time" if isinstance(error, TimeoutError) else str(error)) from None
            if not part:
                raise LineError("the other end has hung up")
            data += part
        return bytes(data)
