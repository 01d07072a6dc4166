"""What every camera must do; run it on each variant, and on a camera of one's own."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from kendama_cli.devices.camera.interface import Camera, Frame, StaleFrame
from kendama_cli.vision.region import Region, whole


def check_camera(camera: Camera, now: Callable[[], float], wait: Callable[[float], None], period_s: float) -> None:
    """Raise AssertionError, naming the rule, where ``camera`` breaks the interface.

    ``now`` is the camera's clock and ``wait`` lets that much time pass on it; ``period_s`` is between two frames.
    The camera must deliver for at least ten more periods, and is closed in the end.
    """
    wait(2 * period_s)
    stamps = []
    for _ in range(3):
        frame = camera.latest(max_age_s=10 * period_s)
        _check_whole(camera, frame, now())
        stamps.append(frame.t_s)
        wait(1.05 * period_s)
    _must(stamps == sorted(stamps), f"stamps must not fall: {stamps}")
    _must(stamps[-1] > stamps[0], f"new frames must come: {stamps}")
    _check_watch(camera, wait, period_s)
    _must(_refusal(camera) is not None, "a frame older than max_age_s must raise StaleFrame")
    refusal = _refusal(camera)
    _must(refusal is not None and refusal.camera == camera.model.name, "StaleFrame must name its camera")
    _must("\n" not in str(refusal), "StaleFrame must be one line")
    camera.close()
    camera.close()


def _must(holds: bool, rule: str) -> None:
    if not holds:
        raise AssertionError(rule)


def _refusal(camera: Camera) -> StaleFrame | None:
    try:
        camera.latest(max_age_s=-1.0)
    except StaleFrame as error:
        return error
    return None


def _check_watch(camera: Camera, wait: Callable[[float], None], period_s: float) -> None:
    image = whole(camera.model.width_px, camera.model.height_px)
    wanted = Region(image.right // 4, image.bottom // 4, image.right // 2, image.bottom // 2)
    for region in (wanted, Region(-20, -20, 8, 8), Region(image.right + 5, 0, image.right + 9, 9), None):
        camera.watch(region)
        wait(1.05 * period_s)
        frame = camera.latest(max_age_s=10 * period_s)
        (left, top), (height, width) = frame.origin_px, frame.pixels.shape[:2]
        shown = Region(left, top, left + width, top + height)
        asked = image if region is None else region.within(image)
        _must(shown.within(image) == shown and not shown.empty, f"a frame must lie in the image, not at {shown}")
        _must(asked.empty or asked.within(shown) == asked, f"a frame must hold the watched region {asked}")


def _check_whole(camera: Camera, frame: Frame, now_s: float) -> None:
    size = (camera.model.height_px, camera.model.width_px, 3)
    _must(frame.pixels.dtype == np.uint8, f"pixels must be uint8, not {frame.pixels.dtype}")
    _must(frame.pixels.shape == size, f"an unwatched camera must show its whole image {size}, not {frame.pixels.shape}")
    _must(frame.t_s <= now_s + 1e-9, f"a frame of {frame.t_s} s cannot come before it was taken, at {now_s} s")
