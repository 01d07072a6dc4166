"""Serving of live cameras over TCP, to whoever has the key."""

from __future__ import annotations

import json
import os
import socket
import threading
import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from kendama_cli.devices.camera.interface import Camera, StaleFrame, open_cameras
from kendama_cli.devices.robot.udp.protocol import Kind
from kendama_cli.devices.robot.udp.seal import NONCE_BYTES, Seal, fresh_nonce, session_number, session_seal
from kendama_cli.errors import HardwareError, KendamaError
from kendama_cli.plugins.camera_server.line import FrameHead, LineError, Request, SealedLine
from kendama_cli.settings.camera import CameraSettings
from kendama_cli.vision.cameras.region import Region, whole

LOOPBACK = "127.0.0.1"
MAX_LINES = 16
"""Connections at a time; each camera of a run has one."""
GREETING_S, SILENCE_S = 2.0, 10.0
"""Who has not shown the key in the first is hung up on; who asks for nothing in the second too."""
WAIT_S, POLL_S = 0.003, 0.0005
"""A request waits so long for a new frame, for the next one may ask for another region; it looks for one so often."""
STALE_S = 0.5
"""An older frame is none; the commander judges what is too old for it."""
_CHECK_S = 0.5


def serve_cameras(
    settings: CameraSettings,
    secret: bytes,
    *,
    host: str = LOOPBACK,
    port: int = 0,
    on_ready: Callable[[Mapping[str, Any]], None],
    keep_going: Callable[[], bool] = lambda: True,
) -> None:
    """Serve the live cameras of ``settings`` on ``host:port`` (0: any free port) until ``keep_going()`` is false.

    ``on_ready`` is called once with ``host, port, cameras, pid``. Raises HardwareError where the address cannot be
    used, and what opening the cameras raises.
    """
    cameras = open_cameras(settings, time.monotonic, None)
    lines = threading.BoundedSemaphore(MAX_LINES)
    try:
        with socket.socket(socket.AF_INET, socket.SOCK_STREAM) as listener:
            listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            try:
                listener.bind((host, port))
                listener.listen()
            except (OSError, OverflowError) as error:
                problem = f"the cameras cannot be served on {host}:{port}: {error}; choose another port"
                raise HardwareError(problem) from None
            listener.settimeout(_CHECK_S)
            bound, number = listener.getsockname()
            names = [one.model.name for one in cameras]
            on_ready({"host": bound, "port": number, "cameras": names, "pid": os.getpid()})
            while keep_going():
                with suppress(TimeoutError, ConnectionError):
                    line, _ = listener.accept()
                    if lines.acquire(blocking=False):
                        threading.Thread(target=_serve_line, args=(line, secret, cameras, lines), daemon=True).start()
                    else:
                        line.close()
    finally:
        for camera in cameras:
            camera.close()


def _serve_line(
    connection: socket.socket, secret: bytes, cameras: Sequence[Camera], lines: threading.BoundedSemaphore
) -> None:
    """Answer one commander until the line ends."""
    line = SealedLine(connection, Seal(secret))
    try:
        connection.settimeout(GREETING_S)
        _greet(line, secret, cameras)
        connection.settimeout(SILENCE_S)
        newest = 1
        while True:
            asked = line.receive(Kind.COMMAND, counter=None)
            received_s = line.arrived_s
            if asked.counter <= newest:
                raise LineError("a request came again")
            newest = asked.counter
            _answer(line, newest, Request.unpack(asked.payload), received_s, cameras)
    except LineError:
        pass
    finally:
        line.close()
        lines.release()


def _greet(line: SealedLine, secret: bytes, cameras: Sequence[Camera]) -> None:
    """Begin a session, as the robot does."""
    theirs, ours = line.receive(Kind.HELLO, counter=0).payload, fresh_nonce()
    if len(theirs) != NONCE_BYTES:
        raise LineError("a greeting without a nonce came")
    line.send(line.pack(Kind.CHALLENGE, 0, theirs + ours))
    line.seal, line.session = session_seal(secret, theirs, ours), session_number(ours)
    line.receive(Kind.OPEN, counter=1)
    models = [one.model for one in cameras]
    named = [{"name": one.name, "width_px": one.width_px, "height_px": one.height_px} for one in models]
    line.send(line.pack(Kind.WELCOME, 1, json.dumps(named).encode()))


def _answer(line: SealedLine, counter: int, request: Request, received_s: float, cameras: Sequence[Camera]) -> None:
    """Send the first frame that is newer than the one that is known; raises LineError for a camera that is none."""
    if request.camera >= len(cameras) or not 0 <= request.quality <= 100:
        raise LineError("a request for no camera came")
    camera, until_s = cameras[request.camera], time.monotonic() + WAIT_S
    while True:
        try:
            frame = camera.latest(max_age_s=STALE_S)
        except StaleFrame:
            frame = None
        except KendamaError as error:
            line.send(line.pack(Kind.STOPPED, counter, str(error).encode()))
            return
        if frame is not None and frame.t_s > request.after_s:
            break
        if time.monotonic() > until_s:
            line.send(line.pack(Kind.WORKING, counter))
            return
        time.sleep(POLL_S)
    image = whole(camera.model.width_px, camera.model.height_px)
    asked = Region(*request.region).within(image)
    part = image if asked.empty else asked
    pixels = np.ascontiguousarray(frame.pixels[part.top : part.bottom, part.left : part.right])
    body = line.pack(Kind.STATE, counter, _encoded(pixels, request.quality))
    box = (part.left, part.top, pixels.shape[1], pixels.shape[0])
    head = FrameHead(received_s, time.monotonic(), frame.t_s, request.quality > 0, box)
    line.send(line.pack(Kind.STATE, counter, head.pack()))
    line.send(body)


def _encoded(pixels: NDArray[np.uint8], quality: int) -> bytes:
    if not quality:
        return pixels.tobytes()
    return bytes(cv2.imencode(".jpg", pixels, [cv2.IMWRITE_JPEG_QUALITY, quality])[1])
