"""Sensor of a camera, from light to numbers: focus, gain, noise, and losses in transmission."""

from __future__ import annotations

import math
from collections.abc import Callable

import cv2
import numpy as np
from numpy.typing import NDArray

from kendama_cli.rendering import kernel_light
from kendama_cli.schema.arrays import Array
from kendama_cli.settings.camera import SensorSettings
from kendama_cli.vision.cameras.region import Region

CODES = 2**16
"""Steps of the sensor's converter, before gamma makes 8 bits of them."""
BLOCK_PX = 16
"""JPEG with halved colours works on squares of this size; a neighbour's colours reach into a square."""
FOCUS_SIGMAS = 4.0


class Sensor:
    """One kind of sensor; what a region shows is what the whole image shows there."""

    def __init__(self, settings: SensorSettings) -> None:
        self._settings = settings
        self._levels = np.rint(np.linspace(0.0, 1.0, CODES) ** (1 / settings.gamma) * 255).astype(np.uint8)
        self._blur_px = math.ceil(FOCUS_SIGMAS * settings.focus_sigma_px)

    def image(
        self, light: Callable[[Region], Array], region: Region, image: Region, *, t_s: float, key: np.uint64
    ) -> NDArray[np.uint8]:
        """Return the pixels (h, w, 3) of ``region`` of ``image``, BGR, at ``t_s``; ``key`` is the noise's.

        ``light`` returns the light (h, w, 3) in a region, linear, red green blue.
        """
        sent = self._sent(region).within(image)
        seen = Region(
            sent.left - self._blur_px, sent.top - self._blur_px, sent.right + self._blur_px, sent.bottom + self._blur_px
        ).within(image)
        pixels = self._encoded(self._digitised(self._focused(light(seen), seen, sent), sent, image, t_s, key))
        return np.ascontiguousarray(_part(pixels, sent, region))

    def _sent(self, region: Region) -> Region:
        """Return the region to digitise so that coding ``region`` equals coding the whole image there."""
        if self._settings.encoding == "raw":
            return region
        low = [max(side // BLOCK_PX - 1, 0) * BLOCK_PX for side in (region.left, region.top)]
        high = [(-(-side // BLOCK_PX) + 1) * BLOCK_PX for side in (region.right, region.bottom)]
        return Region(*low, *high)

    def _focused(self, light: Array, seen: Region, sent: Region) -> Array:
        if not self._blur_px:
            return light
        size = 2 * self._blur_px + 1
        blurred = cv2.GaussianBlur(light, (size, size), self._settings.focus_sigma_px, borderType=cv2.BORDER_REPLICATE)
        return np.ascontiguousarray(_part(np.asarray(blurred), seen, sent))

    def _digitised(self, light: Array, sent: Region, image: Region, t_s: float, key: np.uint64) -> NDArray[np.uint8]:
        sensor = self._settings
        drift = 1.0 + sensor.gain_drift * math.sin(2 * math.pi * sensor.gain_drift_hz * t_s)
        pixels = np.empty(light.shape, dtype=np.uint8)
        kernel_light.digitise(
            light, sent.left, sent.top, image.right, key, sensor.gain * drift, sensor.full_well_e,
            sensor.read_noise_e, self._levels, pixels,
        )  # fmt: skip
        return pixels

    def _encoded(self, pixels: NDArray[np.uint8]) -> NDArray[np.uint8]:
        if self._settings.encoding == "jpeg":
            chosen = [
                cv2.IMWRITE_JPEG_QUALITY, self._settings.jpeg_quality,
                cv2.IMWRITE_JPEG_SAMPLING_FACTOR, cv2.IMWRITE_JPEG_SAMPLING_FACTOR_420,
            ]  # fmt: skip
            return np.asarray(cv2.imdecode(cv2.imencode(".jpg", pixels, chosen)[1], cv2.IMREAD_COLOR), dtype=np.uint8)
        if self._settings.encoding == "yuv420":
            planes = cv2.cvtColor(pixels, cv2.COLOR_BGR2YUV_I420)
            return np.asarray(cv2.cvtColor(planes, cv2.COLOR_YUV2BGR_I420), dtype=np.uint8)
        return pixels


def _part(pixels: NDArray[np.generic], whole: Region, region: Region) -> NDArray[np.generic]:
    return pixels[
        region.top - whole.top : region.bottom - whole.top, region.left - whole.left : region.right - whole.left
    ]
