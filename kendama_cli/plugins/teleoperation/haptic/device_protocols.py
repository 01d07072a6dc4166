"""Messages of a haptic device's server and forces for it: by OpenIGTLink, or as a VRPN force device.

VRPN (vrpn_ForceDevice.h, vrpn_Phantom.C): the device is a tracker whose sensor 0 is the stylus, buttons (``Change``:
a number and its state; ``States``: how many, and the state of each), and a force field, ``Force_Field``: 32-bit floats
for where the stylus was, the force there [N], how it changes with the way from there (3 x 3) and how far from there it
holds. The server keeps the last field until its last client has gone or the stylus has left the field.
"""

from __future__ import annotations

import socket
import struct
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Generic, Protocol, TypeVar

from kendama_cli.errors import HardwareError
from kendama_cli.plugins.shared.streams import vrpn
from kendama_cli.plugins.shared.streams.openigtlink import TEXT_BEGINS, TRANSFORM, MessageStream, transform
from kendama_cli.plugins.teleoperation.haptic.settings import HapticCapture
from kendama_cli.schema.units import METRES

Vector = tuple[float, float, float]
BUTTON = struct.Struct(">ii")
FORCE_FIELD = struct.Struct(">16f")
FIELD_TYPE, ERROR_TYPE = "vrpn_ForceDevice Force_Field", "vrpn_ForceDevice Force_Error"
FIELD_REACH_M = 0.1
"""A stylus farther away feels nothing: more than it moves in some periods, in case that we stop unseen."""
ERRORS = (
    "a value is out of its range",
    "its loop takes too long",
    "too large a force, hot motors or amplifiers that are off",
    "a fault without a name",
)
Said = TypeVar("Said")
_CLOSED = "the haptic device's server has closed the line: look at it, start it anew, and run again"


@dataclass(frozen=True)
class Place:
    """Position of the stylus, in the server's axes and unit."""

    position: Vector


@dataclass(frozen=True)
class Grip:
    """State of the dead-man's switch."""

    held: bool


@dataclass(frozen=True)
class Trouble:
    """A fault that the device tells of itself."""

    words: str


Told = Place | Grip | Trouble


class DeviceProtocol(Protocol):
    """``name`` of the protocol, ``hello`` that a client says first, and ``pose``: which message has the place."""

    name: str
    hello: bytes
    pose: str

    def feed(self, data: bytes) -> Iterator[Told]:
        """Parse bytes into messages; raises ValueError if they are of another protocol, or damaged."""

    def force(self, force_n: Vector, at: Vector) -> bytes:
        """Return the message for a force on the stylus, in the server's axes, at the stylus's last position ``at``."""


class OpenIgtlinkDevice:
    """TRANSFORM and STRING."""

    name, hello = "OpenIGTLink", b""

    def __init__(self, settings: HapticCapture) -> None:
        self._device, self._stream = settings.device, MessageStream()
        self.pose = f"TRANSFORM '{settings.device}'"

    def feed(self, data: bytes) -> Iterator[Told]:
        """Yield the messages in these bytes."""
        for message in self._stream.feed(data):
            kind, content = (message.kind, message.device), message.content
            if kind == ("TRANSFORM", self._device) and len(content) == TRANSFORM.size:
                x, y, z = TRANSFORM.unpack(content)[9:]
                yield Place((x, y, z))
            elif kind == ("STRING", f"{self._device}-grip") and len(content) >= TEXT_BEGINS:
                yield Grip(content[TEXT_BEGINS:].strip(b"\0 ") == b"1")

    def force(self, force_n: Vector, at: Vector) -> bytes:
        """Return the force as a position."""
        return transform(f"{self._device}-force", force_n)


class VrpnDevice:
    """A tracker with buttons and a force field."""

    name = "VRPN"

    def __init__(self, settings: HapticCapture) -> None:
        self._device, self._button, self._stream = settings.device, settings.button, vrpn.VrpnStream()
        self.pose = f"Pos_Quat of '{settings.device}'"
        self.hello = vrpn.COOKIE + vrpn.named(vrpn.SENDER, 0, settings.device) + vrpn.named(vrpn.TYPE, 0, FIELD_TYPE)
        self._reach = FIELD_REACH_M / METRES[settings.spoken_unit]

    def feed(self, data: bytes) -> Iterator[Told]:
        """Yield the messages in these bytes."""
        for message in self._stream.feed(data):
            if message.sender != self._device:
                continue
            if (report := vrpn.tracker_report(message)) is not None:
                if report.sensor == 0:
                    yield Place(report.position)
            elif message.kind == ERROR_TYPE:
                (code,) = struct.unpack(">i", message.content)
                if code < len(ERRORS):
                    yield Trouble(ERRORS[max(code, 0)])
            elif (state := self._state(message)) is not None:
                yield Grip(state != 0)

    def _state(self, message: vrpn.Message) -> int | None:
        """Return the state of our button, if the message has it."""
        if message.kind == "vrpn_Button Change" and len(message.content) == BUTTON.size:
            number, state = BUTTON.unpack(message.content)
            return int(state) if number == self._button else None
        if message.kind == "vrpn_Button States":
            states = struct.unpack(f">{len(message.content) // 4}i", message.content)[1:]
            return states[self._button] if self._button < len(states) else None
        return None

    def force(self, force_n: Vector, at: Vector) -> bytes:
        """Return a field that is the same everywhere within reach of ``at``."""
        return vrpn.message_bytes(0, 0, FORCE_FIELD.pack(*at, *force_n, *[0.0] * 9, self._reach))


DEVICES: Mapping[str, Callable[[HapticCapture], DeviceProtocol]] = {
    "openigtlink": OpenIgtlinkDevice,
    "vrpn": VrpnDevice,
}
"""Readers by the value of ``capture.protocol``."""


class HapticLine(Generic[Said]):
    """A connected socket that sends and receives whole messages without ever waiting."""

    def __init__(self, connected: socket.socket, feed: Callable[[bytes], Iterator[Said]]) -> None:
        """Parse incoming bytes by ``feed``, which raises ValueError for foreign ones."""
        connected.setblocking(False)
        if connected.family in (socket.AF_INET, socket.AF_INET6):
            connected.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self._socket, self._feed = connected, feed

    def send(self, data: bytes) -> None:
        """Send what fits; raises HardwareError where the other end has gone."""
        try:
            self._socket.send(data)
        except BlockingIOError:  # the other end does not read; the next force will be newer
            return
        except OSError as error:
            raise HardwareError(f"{_CLOSED} ({error.strerror})") from None

    def receive(self) -> Iterator[Said]:
        """Yield every whole message that has come; raises HardwareError for a foreign or damaged one."""
        try:
            data = self._socket.recv(65536)
            if not data:
                raise HardwareError(_CLOSED)
        except BlockingIOError:
            return
        except OSError as error:
            raise HardwareError(f"{_CLOSED} ({error.strerror})") from None
        try:
            yield from self._feed(data)
        except ValueError as wrong:
            raise HardwareError(
                f"the haptic device's server {wrong}; look at capture.protocol and capture.port"
            ) from None

    def close(self) -> None:
        """Close it; idempotent."""
        self._socket.close()
