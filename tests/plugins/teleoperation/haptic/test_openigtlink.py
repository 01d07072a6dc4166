"""Our side of OpenIGTLink against pyigtl, and against what is no OpenIGTLink."""

import contextlib
import socket
import time

import numpy as np
import pytest

from kendama_cli.errors import HardwareError
from kendama_cli.plugins.shared.streams.openigtlink import (
    EXTENDED,
    HEADER,
    TRANSFORM,
    MessageStream,
    crc64,
    string,
    transform,
)
from kendama_cli.plugins.teleoperation.haptic.device_protocols import HapticLine


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
        line = HapticLine(connected, MessageStream().feed)
        while not server.is_connected():
            time.sleep(0.01)
        matrix = np.eye(4)
        matrix[:3, 3] = (0.1, -0.2, 0.3)
        server.send_message(pyigtl.TransformMessage(matrix, device_name="Stylus"), wait=True)
        server.send_message(pyigtl.StringMessage("1", device_name="Stylus-grip"), wait=True)
        stylus, grip = hear(line, 2)
        assert (stylus.kind, stylus.device, grip.kind, grip.device) == (
            "TRANSFORM",
            "Stylus",
            "STRING",
            "Stylus-grip",
        )
        assert TRANSFORM.unpack(stylus.content)[9:] == pytest.approx((0.1, -0.2, 0.3), abs=1e-6)
        assert grip.content[4:].strip(b"\0") == b"1"
        line.send(transform("Stylus-force", (1.0, 2.0, -3.0)))
        felt = server.wait_for_message("Stylus-force", timeout=20)
        assert felt.matrix[:3, 3] == pytest.approx([1.0, 2.0, -3.0])
        line.close()
    finally:
        server.stop()


@pytest.mark.parametrize(
    ("sent", "words"),
    [
        (b"GET / HTTP/1.1\r\nHost: kendama\r\nAccept: everything at all, really\r\n\r\n", "does not speak OpenIGTLink"),
        (transform("Stylus", (0.0, 0.0, 0.0))[:-1] + b"x", "sent a damaged TRANSFORM: its checksum does not fit"),
        (HEADER.pack(2, b"STRING", b"grip", 0, 2, crc64(b"ab")) + b"ab", "too short for its extended header"),
    ],
    ids=["http", "damaged", "short"],
)
def test_what_is_no_openigtlink_is_told(sent, words):
    ours, theirs = socket.socketpair()
    with theirs:
        theirs.sendall(string("Stylus-grip", "1") + sent)
        line = HapticLine(ours, MessageStream().feed)
        with pytest.raises(HardwareError, match=words):
            list(line.receive())
        line.close()


def test_messages_come_whole_however_they_are_cut_and_others_are_passed_over():
    body = EXTENDED.pack(EXTENDED.size, 3, 4) + b"text" + b"metadat"
    data = HEADER.pack(2, b"STRING", b"grip", 3 << 31, len(body), crc64(body)) + body
    image = HEADER.pack(1, b"IMAGE", b"camera", 0, 5, 0) + b"12345"  # nobody looks at its checksum
    stream = MessageStream()
    found = [one for byte in transform("Stylus", (1.0, 2.0, 3.0)) + image + data for one in stream.feed(bytes([byte]))]
    assert [(one.kind, one.device) for one in found] == [("TRANSFORM", "Stylus"), ("STRING", "grip")]
    assert (found[1].stamp_s, found[1].content) == (1.5, b"text")
