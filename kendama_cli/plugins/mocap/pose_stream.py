"""Poses that a server streams, by OpenIGTLink or VRPN: every one of them, with its own stamp."""

from __future__ import annotations

import socket
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from kendama_cli.errors import HardwareError
from kendama_cli.motion.rotation import exponential, log_of
from kendama_cli.plugins.shared.streams.openigtlink import TRANSFORM, MessageStream
from kendama_cli.plugins.shared.streams.vrpn import COOKIE, VrpnStream, tracker_report

TIMEOUT_S = 3.0


@dataclass(frozen=True)
class StreamedPose:
    """A body by its name there, in the unit of the server; ``rotation_wxyz`` (4,) NaN where it is no rotation."""

    body: str
    stamp_s: float
    position: tuple[float, ...]
    rotation_wxyz: tuple[float, ...]


@dataclass(frozen=True)
class Protocol:
    """Protocol of a stream: its name, a client's first message, and the parser of poses."""

    name: str
    hello: bytes
    reader: Callable[[], Callable[[bytes], Iterator[StreamedPose]]]


def streamed_poses(protocol: Protocol, host: str, port: int) -> Iterator[StreamedPose]:
    """Yield every pose that comes, of any body.

    Ends where the server closes the line; raises HardwareError where it is not there, silent for 3 s, or speaks
    something else.
    """
    where = f"the {protocol.name} server at {host}:{port}"
    try:
        line = socket.create_connection((host, port), timeout=TIMEOUT_S)
    except OSError as wrong:
        raise HardwareError(
            f"{where} is not there ({wrong.strerror or wrong}); look at capture.host, capture.port and the server"
        ) from None
    read = protocol.reader()
    with line:
        line.sendall(protocol.hello)
        while data := _received(line, where):
            try:
                yield from read(data)
            except ValueError as wrong:
                raise HardwareError(f"{where} {wrong}; look at capture.protocol and capture.port") from None


def _received(line: socket.socket, where: str) -> bytes:
    """Return the bytes that have come; empty if the line was closed. Raises HardwareError after a silence."""
    try:
        return line.recv(1 << 16)
    except TimeoutError:
        raise HardwareError(f"{where} has been silent for {TIMEOUT_S:g} s; is it streaming?") from None
    except OSError:
        return b""


def _openigtlink() -> Callable[[bytes], Iterator[StreamedPose]]:
    stream = MessageStream()

    def read(data: bytes) -> Iterator[StreamedPose]:
        for message in stream.feed(data):
            if message.kind != "TRANSFORM" or len(message.content) < TRANSFORM.size:
                continue
            values = np.array(TRANSFORM.unpack_from(message.content), dtype=np.float64)
            matrix = values[:9].reshape(3, 3).T
            turns = np.isfinite(matrix).all() and np.linalg.det(matrix) > 0  # a mirror is no turn
            turned = exponential(log_of(matrix)) if turns else np.full(4, np.nan)
            yield StreamedPose(message.device, message.stamp_s, tuple(values[9:].tolist()), tuple(turned.tolist()))

    return read


def _vrpn() -> Callable[[bytes], Iterator[StreamedPose]]:
    stream = VrpnStream()

    def read(data: bytes) -> Iterator[StreamedPose]:
        for message in stream.feed(data):
            if (one := tracker_report(message)) is None:
                continue
            name = one.tracker if one.sensor == 0 else f"{one.tracker}:{one.sensor}"
            yield StreamedPose(name, one.stamp_s, one.position, one.rotation_wxyz)

    return read


PROTOCOLS: Mapping[str, Protocol] = {
    "openigtlink": Protocol("OpenIGTLink", b"", _openigtlink),
    "vrpn": Protocol("VRPN", COOKIE, _vrpn),
}
"""By the value of ``capture.protocol``."""
