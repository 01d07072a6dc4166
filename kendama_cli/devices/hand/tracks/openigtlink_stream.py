"""Poses that an OpenIGTLink server streams: every message, with its own stamp."""

from __future__ import annotations

import socket
from collections.abc import Iterator

import numpy as np

from kendama_cli.devices.hand.openigtlink import TRANSFORM, MessageStream
from kendama_cli.errors import HardwareError
from kendama_cli.motion.rotation import exponential
from kendama_cli.motion.rotation_matrix import log_of

TIMEOUT_S = 3.0


def transforms(host: str, port: int) -> Iterator[tuple[str, float, tuple[float, ...]]]:
    """Device, its stamp [s], and place [m] with the quaternion wxyz (7), for every transform that comes.

    Ends where the server closes the line; raises HardwareError where it is not there, silent for 3 s, or speaks
    something else.
    """
    where = f"the OpenIGTLink server at {host}:{port}"
    try:
        line = socket.create_connection((host, port), timeout=TIMEOUT_S)
    except OSError as wrong:
        raise HardwareError(
            f"{where} is not there ({wrong.strerror or wrong}); look at capture.host, capture.port and the server"
        ) from None
    stream = MessageStream()
    with line:
        while data := _received(line, where):
            try:
                for message in stream.feed(data):
                    if message.kind == "TRANSFORM" and len(message.content) >= TRANSFORM.size:
                        yield message.device, message.stamp_s, _pose(message.content)
            except ValueError as wrong:
                raise HardwareError(f"{where} {wrong}") from None


def _pose(content: bytes) -> tuple[float, ...]:
    values = np.array(TRANSFORM.unpack_from(content), dtype=np.float64)
    matrix = values[:9].reshape(3, 3).T
    turned = exponential(log_of(matrix)) if np.isfinite(matrix).all() else np.full(4, np.nan)
    return (*(values[9:] / 1e3).tolist(), *turned.tolist())


def _received(line: socket.socket, where: str) -> bytes:
    """What has come; empty where the line was closed. Raises HardwareError after a silence."""
    try:
        return line.recv(1 << 16)
    except TimeoutError:
        raise HardwareError(f"{where} has been silent for {TIMEOUT_S:g} s; is it streaming?") from None
    except OSError:
        return b""
