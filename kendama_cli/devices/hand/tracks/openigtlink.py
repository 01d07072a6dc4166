"""A small client for OpenIGTLink's transforms (versions 1 to 3, openigtlink.org): every message, with its own stamp.

``pyigtl`` keeps only the newest message of each device and looks for it every 10 ms, so a recording through it loses
samples; the tests let its server speak to this client.
"""

from __future__ import annotations

import socket
import struct
from collections.abc import Iterator

import numpy as np

from kendama_cli.errors import HardwareError
from kendama_cli.motion.rotation import exponential
from kendama_cli.motion.rotation_matrix import log_of

HEADER = struct.Struct(">H12s20sQQQ")
"""Version, type, device, time stamp in 2^-32 s, size of the body, checksum."""
EXTENDED = struct.Struct(">HHII")
TRANSFORM = struct.Struct(">12f")
"""The rotation matrix column by column, then the place [mm]."""
LARGEST_BODY = 1 << 24
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
    with line:
        while True:
            head = _exactly(line, HEADER.size, where)
            if head is None:
                return
            version, kind, device, stamp, size, _ = HEADER.unpack(head)
            if not 1 <= version <= 3 or size > LARGEST_BODY:
                raise HardwareError(f"{where} does not speak OpenIGTLink (version {version}, {size} bytes)")
            body = _exactly(line, size, where)
            if body is None:
                return
            if version > 1 and len(body) >= EXTENDED.size:
                body = body[EXTENDED.unpack_from(body)[0] :]
            if kind.rstrip(b"\0") == b"TRANSFORM" and len(body) >= TRANSFORM.size:
                yield device.rstrip(b"\0").decode("utf-8", "replace"), stamp / 2**32, _pose(body)


def _pose(body: bytes) -> tuple[float, ...]:
    values = np.array(TRANSFORM.unpack_from(body), dtype=np.float64)
    matrix = values[:9].reshape(3, 3).T
    turned = exponential(log_of(matrix)) if np.isfinite(matrix).all() else np.full(4, np.nan)
    return (*(values[9:] / 1e3).tolist(), *turned.tolist())


def _exactly(line: socket.socket, count: int, where: str) -> bytes | None:
    """``count`` bytes; None where the line was closed. Raises HardwareError after a silence."""
    data = bytearray()
    while len(data) < count:
        try:
            part = line.recv(count - len(data))
        except TimeoutError:
            raise HardwareError(f"{where} has been silent for {TIMEOUT_S:g} s; is it streaming?") from None
        except OSError:
            return None
        if not part:
            return None
        data += part
    return bytes(data)
