"""A hand that is seen now: the camera is recorded to a film first, which is kept, and the film is read."""

from __future__ import annotations

import math
import time
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import cv2

from kendama_cli.devices.demonstrator.file import RecordedDemonstrator
from kendama_cli.devices.demonstrator.live_figures import LiveFigures, Tell
from kendama_cli.errors import ConfigError, HardwareError
from kendama_cli.plugins.marker.films import FEWEST_SEEN, films_of
from kendama_cli.plugins.marker.settings import MarkerLiveCapture
from kendama_cli.schema.units import count_of

SLOW_SHARE = 0.9
"""A camera that gives fewer of the frames that it says has wrong times: it is slow in the dark, say."""


def open_marker_live(settings: MarkerLiveCapture, tell: Tell) -> Sequence[RecordedDemonstrator]:
    """Open a demonstrator for every swing in the film; ``tell`` reports the images as they come.

    Raises HardwareError for a camera that is not there or goes away at once.
    """
    film, rate_hz, notes = _recorded(settings, tell)
    hands = films_of((film,), settings if rate_hz is None else replace(settings, rate_hz=rate_hz), tell)
    hands[0].warnings = (*notes, *hands[0].warnings)
    return hands


def _recorded(settings: MarkerLiveCapture, tell: Tell) -> tuple[str, float | None, list[str]]:
    """Record the device for a while: the film, its rate where the camera was slower than it says, and lines about it.

    What was recorded is kept where the device goes away.
    """
    output = Path(settings.record)
    if output.exists():
        raise ConfigError(
            "capture.record",
            f"'capture.record' is {output}, which exists; a recording is never overwritten: name another",
        )
    source = settings.device
    device = cv2.VideoCapture(int(source) if str(source).isdigit() else str(source))
    film: cv2.VideoWriter | None = None
    figures = LiveFigures(tell, settings.seconds)
    count, began, last_s, rate_hz, notes = 0, time.monotonic(), 0.0, 30.0, list[str]()
    try:
        if not device.isOpened():
            raise HardwareError(f"camera '{source}' is not there; look at capture.device and at 'kendama camera check'")
        said = float(device.get(cv2.CAP_PROP_FPS))
        rate_hz = said if math.isfinite(said) and 1 <= said <= 1000 else rate_hz
        while time.monotonic() - began < settings.seconds:
            good, pixels = device.read()
            if not good:
                seen = count_of(count, "frame")
                notes.append(f"camera '{source}' went away after {seen}; what came before is kept in {output}")
                break
            if film is None:
                size = (pixels.shape[1], pixels.shape[0])
                film = cv2.VideoWriter(str(output), cv2.VideoWriter.fourcc(*"MJPG"), rate_hz, size)
            film.write(pixels)
            count += 1
            last_s = time.monotonic()
            figures.add(last_s)
            began = began if count > 1 else last_s
    finally:
        device.release()
        if film is not None:
            film.release()
    if count < FEWEST_SEEN:
        raise HardwareError(
            f"camera '{source}' gave {count_of(count, 'frame')} and went away; look at its cable and its driver"
        )
    true_hz = (count - 1) / max(last_s - began, 1e-9)
    if settings.rate_hz is not None or true_hz > SLOW_SHARE * rate_hz:
        return str(output), None, notes
    notes.append(
        f"camera '{source}' gave {true_hz:.1f} frames a second where it says {rate_hz:g}: the former are taken, and "
        f"capture.rate_hz={true_hz:.1f} reads {output} so again; give it more light"
    )
    return str(output), true_hz, notes
