"""Live cameras through OpenCV: devices of this machine, and streams by their addresses."""

from __future__ import annotations

import math
import threading
from collections.abc import Callable, Sequence
from urllib.parse import urlsplit

import cv2
import numpy as np
from numpy.typing import NDArray

from kendama_cli.devices.camera.interface import (
    Frame,
    RegionOfInterest,
    SceneSource,
    StaleFrame,
    require_one_each,
    too_old,
)
from kendama_cli.errors import HardwareError, MissingPartError
from kendama_cli.settings.camera import DeviceCamera
from kendama_cli.vision.cameras.camera_model import CameraModel
from kendama_cli.vision.cameras.region import Region


def open_device(
    settings: DeviceCamera, models: Sequence[CameraModel], clock: Callable[[], float], scene: SceneSource | None
) -> list[DeviceCameraBlock]:
    """Open devices or streams, see OpenCameras.

    Raises ConfigError unless there is one index or address per camera, MissingPartError where none answers.
    """
    if settings.addresses:
        require_one_each("camera.addresses", settings.addresses, "a stream's address", len(models))
    else:
        require_one_each("camera.indices", settings.indices, "an OpenCV device index", len(models))
    sources: Sequence[int | str] = settings.addresses or settings.indices
    opened: list[DeviceCameraBlock] = []
    try:
        for model, source in zip(models, sources, strict=True):
            opened.append(DeviceCameraBlock(model, source, settings, clock=clock))
    except BaseException:
        for camera in opened:
            camera.close()
        raise
    return opened


STREAM_TIMEOUT_S = 3.0
"""A stream that is silent for so long has broken off."""


def open_capture(source: int | str) -> cv2.VideoCapture:
    """Open a device by its index, or a stream by its address."""
    if isinstance(source, int):
        return cv2.VideoCapture(source)
    timeout_ms = round(1e3 * STREAM_TIMEOUT_S)
    timeouts = [cv2.CAP_PROP_OPEN_TIMEOUT_MSEC, timeout_ms, cv2.CAP_PROP_READ_TIMEOUT_MSEC, timeout_ms]
    return cv2.VideoCapture(source, cv2.CAP_FFMPEG, timeouts)


class DeviceCameraBlock:
    """A thread keeps the newest frame of one ``source``; its stamp is the arrival less the settings' latency.

    An image that equals the one before it byte for byte is that one again, and keeps its stamp. A stream that broke
    off is opened anew.
    Raises MissingPartError where no such camera answers, HardwareError where its images do not fit the calibration.
    """

    def __init__(
        self,
        model: CameraModel,
        source: int | str,
        settings: DeviceCamera,
        *,
        clock: Callable[[], float],
        open_device: Callable[[int | str], cv2.VideoCapture] = open_capture,
    ) -> None:
        self.model, self._source, self._open = model, source, open_device
        self._clock, self._latency_s = clock, settings.latency_s
        self._region = RegionOfInterest(model)
        self._capture = open_device(source)
        if not self._capture.isOpened():
            self._capture.release()
            raise _missing(source)
        if isinstance(source, int):
            self._capture.set(cv2.CAP_PROP_FRAME_WIDTH, model.width_px)
            self._capture.set(cv2.CAP_PROP_FRAME_HEIGHT, model.height_px)
            self._capture.set(cv2.CAP_PROP_FPS, settings.rate_hz)
        self._newest: tuple[float, NDArray[np.uint8]] | None = None
        self._doubled = 0
        self._stop, self._arrived = threading.Event(), threading.Event()
        self._thread = threading.Thread(target=self._grab, name=f"camera-{model.name}", daemon=True)
        self._thread.start()

    @property
    def next_s(self) -> None:
        """Return None: the next frame's time is unknown."""

    def set_region_of_interest(self, region: Region | None) -> None:
        self._region.set(region)

    def latest(self, *, max_age_s: float) -> Frame:
        self._arrived.wait(timeout=max_age_s)
        newest = self._newest
        if newest is None:
            raise StaleFrame(
                self.model.name,
                math.inf,
                f"camera '{self.model.name}': no frame came within {max_age_s:.3g} s; check its cable and that "
                "no other program holds it",
            )
        t_s, pixels = newest
        if pixels.shape != (self.model.height_px, self.model.width_px, 3):
            height, width = pixels.shape[:2]
            raise HardwareError(
                f"camera '{self.model.name}' delivers {width} x {height} px, but is calibrated for "
                f"{self.model.width_px} x {self.model.height_px} px; calibrate for this size or choose another mode"
            )
        age = self._clock() - t_s
        if age > max_age_s:
            if self._doubled:
                raise StaleFrame(
                    self.model.name,
                    age,
                    f"camera '{self.model.name}': the newest image is {age * 1e3:.0f} ms old, allowed are "
                    f"{max_age_s * 1e3:.0f} ms, and came {self._doubled} times again byte for byte: the camera hangs; "
                    "connect it anew",
                )
            raise too_old(self.model.name, age, max_age_s)
        return self._region.frame(t_s, pixels)

    def restart(self) -> None:
        """Do nothing: a live camera's time cannot be set back."""

    def close(self) -> None:
        self._stop.set()
        self._thread.join(timeout=2.0 + STREAM_TIMEOUT_S)
        self._capture.release()

    def _grab(self) -> None:
        while not self._stop.is_set():
            good, pixels = self._capture.read()
            if not good:
                if self._stop.wait(0.005):
                    return
                if isinstance(self._source, str):
                    self._capture.release()
                    self._capture = self._open(self._source)
                continue
            arrived_s, newest = self._clock(), self._newest
            if newest is not None and np.array_equal(newest[1], pixels):  # noise makes every real image another one
                self._doubled += 1
                continue
            self._doubled, self._newest = 0, (arrived_s - self._latency_s, np.asarray(pixels, dtype=np.uint8))
            self._arrived.set()


def _missing(source: int | str) -> MissingPartError:
    if isinstance(source, int):
        return MissingPartError(
            f"camera {source}",
            f"camera=device: no camera answers at index {source} (camera.indices); connect one, check the access "
            f"to /dev/video{source}, or use camera=virtual",
        )
    parts = urlsplit(source)
    shown = f"{parts.scheme}://{parts.netloc.rpartition('@')[2]}{parts.path}"  # without a password
    return MissingPartError(
        f"camera {shown}",
        f"camera=device: no stream at {shown} (camera.addresses); see that the camera is on, and that another program "
        "of this machine shows it",
    )
