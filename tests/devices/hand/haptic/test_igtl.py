"""Our side of OpenIGTLink against pyigtl, and against what is no OpenIGTLink."""

import contextlib
import socket
import time

import numpy as np
import pytest

from kendama_cli.devices.hand.haptic.igtl import MATRIX, IgtlLine, crc64, string, transform
from kendama_cli.errors import HardwareError


def test_the_checksum_is_that_of_ecma_182():
    assert crc64(b"123456789") == 0x6C40DF5F0B497347


def hear(line, count):
    found, until = [], time.monotonic() + 20
    while len(found) < count and time.monotonic() < until:
        found += line.receive()
        time.sleep(0.01)
    return found


def test_pyigtl_understands_us_and_we_understand_it():
    pyigtl = pytest.importorskip("pyigtl")
    with socket.create_server(("127.0.0.1", 0)) as probe:
        port = probe.getsockname()[1]
    server = pyigtl.OpenIGTLinkServer(port=port, local_server=True)
    try:
        connected, until = None, time.monotonic() + 20
        while connected is None:
            assert time.monotonic() < until
            with contextlib.suppress(OSError):
                connected = socket.create_connection(("127.0.0.1", port), timeout=1)
        line = IgtlLine(connected)
        while not server.is_connected():
            time.sleep(0.01)
        matrix = np.eye(4)
        matrix[:3, 3] = (0.1, -0.2, 0.3)
        server.send_message(pyigtl.TransformMessage(matrix, device_name="Stylus"), wait=True)
        server.send_message(pyigtl.StringMessage("1", device_name="Stylus-grip"), wait=True)
        (kind, name, body), (other, grip, text) = hear(line, 2)
        assert (kind, name, other, grip) == ("TRANSFORM", "Stylus", "STRING", "Stylus-grip")
        assert MATRIX.unpack(body)[9:] == pytest.approx((0.1, -0.2, 0.3), abs=1e-6)
        assert text[4:].strip(b"\0") == b"1"
        line.send(transform("Stylus-force", (1.0, 2.0, -3.0)))
        felt = server.wait_for_message("Stylus-force", timeout=20)
        assert felt.matrix[:3, 3] == pytest.approx([1.0, 2.0, -3.0])
        line.close()
    finally:
        server.stop()


@pytest.mark.parametrize(
    ("sent", "words"),
    [
        (b"GET / HTTP/1.1\r\nHost: kendama\r\nAccept: everything at all, really\r\n\r\n", "is no OpenIGTLink"),
        (transform("Stylus", (0.0, 0.0, 0.0))[:-1] + b"x", "is damaged"),
    ],
)
def test_what_is_no_openigtlink_is_told(sent, words):
    ours, theirs = socket.socketpair()
    with theirs:
        theirs.sendall(string("Stylus-grip", "1") + sent)
        line = IgtlLine.__new__(IgtlLine)
        ours.setblocking(False)
        line._socket, line._pending = ours, b""
        with pytest.raises(HardwareError, match=words):
            list(line.receive())
        line.close()
