"""Servers of motion capture for tests: they stream a bundled swing at its own pace, and may do it wrong."""

from __future__ import annotations

import contextlib
import json
import shutil
import socket
import subprocess
import threading
import time
from pathlib import Path

import numpy as np
import pytest

ROOT = Path(__file__).parents[2]
SWING = np.loadtxt(ROOT / "data/demonstrations/swing-01.csv", delimiter=",", comments=("#", "t"))


def free_port(kind=socket.SOCK_STREAM):
    with socket.socket(type=kind) as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


def at_its_pace(send):
    """Call ``send(i, row)`` for every sample of the swing when it is due."""
    began = time.time()
    for i, row in enumerate(SWING):
        time.sleep(max(began + row[0] - time.time(), 0))
        send(i, row)


@contextlib.contextmanager
def vrpn_server(folder, config):
    """The VRPN project's own server with these devices; its port."""
    program = shutil.which("vrpn_server")
    if program is None:
        pytest.skip("no vrpn_server (github vrpn/vrpn, cmake) in the PATH")
    (folder / "vrpn.cfg").write_text(config)
    port = free_port()
    process = subprocess.Popen([program, "-quiet", "-f", str(folder / "vrpn.cfg"), str(port)], cwd=folder)
    try:
        until = time.monotonic() + 20
        while True:
            with contextlib.suppress(OSError), socket.create_connection(("127.0.0.1", port), timeout=1):
                break
            assert process.poll() is None, "vrpn_server has ended"
            assert time.monotonic() < until
            time.sleep(0.05)
        yield port
    finally:
        process.kill()
        process.wait(timeout=20)


def swing_by_json(udp_port, wait_s):
    """The swing into vrpn_Tracker_JsonNet, in a thread, after ``wait_s``."""
    line = socket.socket(type=socket.SOCK_DGRAM)

    def send(i, row):
        message = {"type": 1, "id": 0, "pos": row[1:].tolist(), "quat": [0.0, 0.0, 0.0, 1.0]}
        line.sendto(json.dumps(message).encode(), ("127.0.0.1", udp_port))

    def run():
        time.sleep(wait_s)
        at_its_pace(send)

    threading.Thread(target=run, daemon=True).start()


@contextlib.contextmanager
def replayed(data, *, greeting=b""):
    """A server that sends these bytes to whoever comes (and says ``greeting``), in pieces, and closes; its port."""
    with socket.create_server(("127.0.0.1", 0)) as server:

        def run():
            with contextlib.suppress(OSError):
                client, _ = server.accept()
                with client:
                    heard = b""
                    while len(heard) < len(greeting):
                        heard += client.recv(4096)
                    assert heard == greeting
                    for first in range(0, len(data), 1000):
                        client.sendall(data[first : first + 1000])

        thread = threading.Thread(target=run, daemon=True)
        thread.start()
        yield server.getsockname()[1]
        thread.join(timeout=20)
