"""Live cameras through OpenCV."""

from __future__ import annotations

import math
import threading
from collections.abc import Callable, Sequence

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
    """Open devices, see OpenCameras; raises ConfigError unless there is one index per camera, MissingPartError."""
    require_one_each("camera.indices", settings.indices, "an OpenCV device index", len(models))
    opened: list[DeviceCameraBlock] = []
    try:
        for model, index in zip(models, settings.indices, strict=True):
            opened.append(DeviceCameraBlock(model, index, settings, clock=clock))
    except BaseException:
        for camera in opened:
            camera.close()
        raise
    return opened


class DeviceCameraBlock:
    """A thread keeps the newest frame of one device; its stamp is the arrival less the settings' latency.

    An image that equals the one before it byte for byte is that one again, and keeps its stamp.
    Raises MissingPartError where no such camera answers, HardwareError where its images do not fit the calibration.
    """

    def __init__(
        self,
        model: CameraModel,
        index: int,
        settings: DeviceCamera,
        *,
        clock: Callable[[], float],
        open_device: Callable[[int], cv2.VideoCapture] = cv2.VideoCapture,
    ) -> None:
        self.model = model
        self._clock, self._latency_s = clock, settings.latency_s
        self._region = RegionOfInterest(model)
        self._capture = open_device(index)
        if not self._capture.isOpened():
            self._capture.release()
            raise MissingPartError(
                f"camera {index}",
                f"camera=device: no camera answers at index {index} (camera.indices); connect one, check the access "
                f"to /dev/video{index}, or use camera=virtual",
            )
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
        self._thread.join(timeout=2.0)
        self._capture.release()

    def _grab(self) -> None:
        while not self._stop.is_set():
            good, pixels = self._capture.read()
            if not good:
                if self._stop.wait(0.005):
                    return
                continue
            arrived_s, newest = self._clock(), self._newest
            if newest is not None and np.array_equal(newest[1], pixels):  # noise makes every real image another one
                self._doubled += 1
                continue
            self._doubled, self._newest = 0, (arrived_s - self._latency_s, np.asarray(pixels, dtype=np.uint8))
            self._arrived.set()
