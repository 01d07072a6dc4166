"""Cameras behind a server, as cameras of this process."""

from __future__ import annotations

import json
import math
import socket
import threading
import time
from collections import deque
from collections.abc import Callable, Sequence

import cv2
import numpy as np
from numpy.typing import NDArray

from kendama_cli.devices.camera.interface import Frame, SceneSource, StaleFrame, too_old
from kendama_cli.devices.robot.udp.protocol import Kind
from kendama_cli.devices.robot.udp.seal import NONCE_BYTES, Seal, fresh_nonce, read_key, session_number, session_seal
from kendama_cli.errors import ConfigError, HardwareError, MissingPartError
from kendama_cli.plugins.camera_server.line import IMAGE_BYTES, FrameHead, LineError, Request, SealedLine
from kendama_cli.plugins.camera_server.settings import RemoteCamera
from kendama_cli.vision.cameras.camera_model import CameraModel
from kendama_cli.vision.cameras.region import Region, whole

SILENCE_S = 3.0
"""A server answers every request in less, if only that there is no new frame."""
KEPT, ENOUGH = 200, 8
"""Exchanges that are remembered: some seconds, in which clocks drift by microseconds; so many are enough to begin."""


def open_remote(
    settings: RemoteCamera, models: Sequence[CameraModel], clock: Callable[[], float], scene: SceneSource | None
) -> list[RemoteCameraBlock]:
    """Open cameras behind a server, see OpenCameras.

    Raises MissingPartError where none answers, InputError for the key, ConfigError where a camera is not served.
    """
    opened: list[RemoteCameraBlock] = []
    try:
        for model in models:
            opened.append(RemoteCameraBlock(model, settings, clock=clock))
    except BaseException:
        for camera in opened:
            camera.close()
        raise
    return opened


class RemoteCameraBlock:
    """A thread asks for the newest frame of one camera; its stamp is the server's, on this machine's clock."""

    def __init__(self, model: CameraModel, settings: RemoteCamera, *, clock: Callable[[], float]) -> None:
        self.model = model
        self._clock, self._quality = clock, settings.jpeg_quality or 0
        self._where = f"camera '{model.name}' at {settings.host}:{settings.port}"
        self._region = (0, 0, 0, 0)
        self._newest: Frame | None = None
        self._problem: str | None = None
        secret = read_key(settings.key_file)
        try:
            connection = socket.create_connection((settings.host, settings.port), timeout=SILENCE_S)
        except OSError as error:
            raise self._missing(str(error)) from None
        self._line = SealedLine(connection, Seal(secret))
        try:
            self._number = self._found(_greeted(self._line, secret))
        except LineError as error:
            self._line.close()
            raise self._missing(str(error)) from None
        except ConfigError:
            self._line.close()
            raise
        self._stop, self._arrived = threading.Event(), threading.Event()
        self._thread = threading.Thread(target=self._ask, name=f"camera-{model.name}", daemon=True)
        self._thread.start()

    @property
    def next_s(self) -> None:
        """Return None: the next frame's time is unknown."""

    def set_region_of_interest(self, region: Region | None) -> None:
        image = whole(self.model.width_px, self.model.height_px)
        part = image if region is None else region.within(image)
        self._region = (part.left, part.top, part.right, part.bottom)

    def latest(self, *, max_age_s: float) -> Frame:
        self._arrived.wait(timeout=max_age_s)
        newest = self._newest
        if self._problem is not None:
            raise HardwareError(f"{self._where}: {self._problem}; look at 'kendama camera serve' there, and run again")
        if newest is None:
            problem = f"{self._where}: no frame came within {max_age_s:.3g} s; see that the camera delivers there"
            raise StaleFrame(self.model.name, math.inf, problem)
        age_s = self._clock() - newest.t_s
        if age_s > max_age_s:
            raise too_old(self.model.name, age_s, max_age_s)
        return newest

    def restart(self) -> None:
        """Do nothing: a live camera's time cannot be set back."""

    def close(self) -> None:
        self._stop.set()
        self._line.close()
        self._thread.join(timeout=2.0)

    def _ask(self) -> None:
        offset, after_s, counter = ClockOffset(), -math.inf, 1
        try:
            while not self._stop.is_set():
                counter, left_s = counter + 1, time.monotonic()
                request = Request(self._number, self._quality, after_s, self._region)
                self._line.send(self._line.pack(Kind.COMMAND, counter, request.pack()))
                answer = self._line.receive(Kind.STATE, Kind.WORKING, Kind.STOPPED, counter=counter, at_most=4096)
                if answer.kind is Kind.STOPPED:
                    raise LineError(answer.payload.decode(errors="replace"))
                if answer.kind is Kind.WORKING:
                    continue
                head = FrameHead.unpack(answer.payload)
                offset.add(left_s, head.received_s, head.sent_s, self._line.arrived_s)
                body = self._line.receive(Kind.STATE, counter=counter, at_most=IMAGE_BYTES).payload
                pixels, after_s = _decoded(body, head), head.t_s
                if offset.known:
                    self._newest = Frame(self._on_our_clock(head.t_s - offset.offset_s), pixels, head.box[:2])
                    self._arrived.set()
        except LineError as error:
            self._problem = str(error)
            self._arrived.set()

    def _on_our_clock(self, monotonic_s: float) -> float:
        """Return a monotonic time on the clock of the frames, by the quickest of three looks at both."""
        looks = []
        for _ in range(3):
            before_s, now_s, after_s = time.monotonic(), self._clock(), time.monotonic()
            looks.append((after_s - before_s, now_s - (before_s + after_s) / 2))
        return monotonic_s + min(looks)[1]

    def _found(self, served: object) -> int:
        """Return the camera's number at the server; raises ConfigError where it has none of this name and size."""
        model, names = self.model, []
        for number, one in enumerate(served if isinstance(served, list) else []):
            names.append(str(one.get("name")))
            if names[-1] == model.name:
                size = (one.get("width_px"), one.get("height_px"))
                if size != (model.width_px, model.height_px):
                    raise ConfigError(
                        "camera.cameras",
                        f"{self._where} has {size[0]} x {size[1]} px, but is calibrated for {model.width_px} x "
                        f"{model.height_px} px; give both machines the same calibration",
                    )
                return number
        raise ConfigError(
            "camera.cameras", f"{self._where} is not served; the cameras there are called {', '.join(names)}"
        )

    def _missing(self, problem: str) -> MissingPartError:
        return MissingPartError(
            self._where,
            f"{self._where} is not there: {problem}; start 'kendama camera serve' on its machine, and look at "
            "camera.host and camera.port",
        )


def _greeted(line: SealedLine, secret: bytes) -> object:
    """Begin a session; return the cameras that the server names."""
    ours = fresh_nonce()
    line.send(line.pack(Kind.HELLO, 0, ours))
    answer = line.receive(Kind.CHALLENGE, counter=0).payload
    theirs = answer[NONCE_BYTES:]
    if answer[:NONCE_BYTES] != ours or len(theirs) != NONCE_BYTES:
        raise LineError("the answer is to another greeting")
    line.seal, line.session = session_seal(secret, ours, theirs), session_number(theirs)
    line.send(line.pack(Kind.OPEN, 1))
    return json.loads(line.receive(Kind.WELCOME, counter=1, at_most=1 << 16).payload)


def _decoded(body: bytes, head: FrameHead) -> NDArray[np.uint8]:
    """Return pixels (h, w, 3); raises LineError where they are not of the size that was said."""
    shape = (head.box[3], head.box[2], 3)
    if not head.jpeg:
        if len(body) != math.prod(shape):
            raise LineError("an image of another size came")
        return np.frombuffer(body, dtype=np.uint8).reshape(shape)
    pixels = cv2.imdecode(np.frombuffer(body, dtype=np.uint8), cv2.IMREAD_COLOR)
    if pixels is None or pixels.shape != shape:
        raise LineError("an image of another size came")
    return np.asarray(pixels, dtype=np.uint8)


class ClockOffset:
    """Offset of the other clock from ours by the quickest of the newest exchanges.

    offset = ((t1 - t0) + (t2 - t3)) / 2 of an exchange that left at t0, came at t1 and was answered at t2 on the other
    clock, and was back at t3; it is wrong by at most half of the delay (t3 - t0) - (t2 - t1) (RFC 5905, section 8).
    """

    def __init__(self) -> None:
        self._seen: deque[tuple[float, float]] = deque(maxlen=KEPT)

    def add(self, left_s: float, came_s: float, answered_s: float, back_s: float) -> None:
        """Take the four times of an exchange [s]."""
        delay_s = (back_s - left_s) - (answered_s - came_s)
        self._seen.append((delay_s, ((came_s - left_s) + (answered_s - back_s)) / 2))

    @property
    def known(self) -> bool:
        """Return True after enough exchanges."""
        return len(self._seen) >= ENOUGH

    @property
    def offset_s(self) -> float:
        """Return the other clock's time less ours [s]; raises ValueError before the first exchange."""
        return min(self._seen)[1]
