"""A hand that is seen now: the camera is recorded to a film first, which is kept, and the film is read."""

from __future__ import annotations

import math
import time
from collections.abc import Sequence
from pathlib import Path

import cv2

from kendama_cli.devices.hand.file import RecordedHand
from kendama_cli.devices.hand.marker import FEWEST_SEEN, films_of
from kendama_cli.devices.hand.settings import MarkerLiveCapture
from kendama_cli.errors import ConfigError, HardwareError


def open_marker_live(settings: MarkerLiveCapture) -> Sequence[RecordedHand]:
    """A hand for every swing in the film; raises HardwareError for a camera that is not there or goes away at once."""
    return films_of((_recorded(settings),), settings)


def _recorded(settings: MarkerLiveCapture) -> str:
    """Record the device for a while; the film's path. What was recorded is kept where the device goes away."""
    output = Path(settings.record)
    if output.exists():
        raise ConfigError(
            "capture.record",
            f"'capture.record' is {output}, which exists; a recording is never overwritten: name another",
        )
    source = settings.device
    device = cv2.VideoCapture(int(source) if str(source).isdigit() else str(source))
    film: cv2.VideoWriter | None = None
    count, began = 0, time.monotonic()
    try:
        if not device.isOpened():
            raise HardwareError(f"camera '{source}' is not there; look at capture.device and at 'kendama camera check'")
        rate = float(device.get(cv2.CAP_PROP_FPS))
        rate = rate if math.isfinite(rate) and 1 <= rate <= 1000 else 30.0
        while time.monotonic() - began < settings.seconds:
            good, pixels = device.read()
            if not good:
                break
            if film is None:
                size = (pixels.shape[1], pixels.shape[0])
                film = cv2.VideoWriter(str(output), cv2.VideoWriter.fourcc(*"MJPG"), rate, size)
            film.write(pixels)
            count += 1
    finally:
        device.release()
        if film is not None:
            film.release()
    if count < FEWEST_SEEN:
        raise HardwareError(f"camera '{source}' gave {count} frames and went away; look at its cable and its driver")
    return str(output)
