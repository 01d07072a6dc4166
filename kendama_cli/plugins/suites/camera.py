"""The laws of a camera, for every variant or a project's own (run: see kendama_cli/conformance.py)."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from typing import Any

import numpy as np

from kendama_cli.devices.camera.interface import Camera, Frame, SceneSource, StaleFrame, open_cameras
from kendama_cli.plugins.shared.videos.clock import Clock
from kendama_cli.plugins.suites.law import must
from kendama_cli.rendering.scene import ScenePose, hanging_rope
from kendama_cli.vision.cameras.region import Region, whole


class Opened:
    """The cameras of one configuration, opened anew for each law, with their clock."""

    def __init__(self, configuration: Mapping[str, Any]) -> None:
        self._configuration = configuration

    @contextmanager
    def cameras(self) -> Iterator[tuple[list[Camera], Clock, float]]:
        """Open the cameras; return them, their clock, and the time between two frames [s]."""
        given = self._configuration
        settings = given["camera"]
        rngs = [np.random.default_rng(number) for number, _ in enumerate(settings.cameras)]
        clock = Clock(live=settings.source == "live")
        opened = open_cameras(settings, clock, SceneSource(_still, given["game"], given["lighting"], rngs))
        try:
            yield opened, clock, 1 / settings.rate_hz if settings.rate_hz is not None else _period_s(opened[0], clock)
        finally:
            for one in opened:
                one.close()


def check_frames(opened: Opened) -> None:
    """Check that every camera shows whole images and regions in the order of time, and refuses what is too old."""
    with opened.cameras() as (cameras, clock, period_s):
        for camera in cameras:
            check_camera(camera, clock, clock.wait, period_s)


def check_models(opened: Opened) -> None:
    """Check that cameras come in the order of the settings, each with its own calibration."""
    with opened.cameras() as (cameras, _, _):
        names = [camera.model.name for camera in cameras]
        expected = [one.name for one in opened._configuration["camera"].cameras]
        must(names == expected, f"there is one camera per calibration, in order: {expected}, not {names}")


CHECKS = (check_models, check_frames)


def subject(configuration: Mapping[str, Any]) -> Opened:
    """Open the cameras of ``camera``, before a ball that hangs still."""
    return Opened(configuration)


def test_the_cameras_keep_the_law(law: Callable[[Opened], None], configuration: Mapping[str, Any]) -> None:
    """Run by kendama_cli/conformance.py for every law."""
    law(subject(configuration))


def _still(t_s: float) -> ScenePose:
    ball, tie = np.array([0.0, 0.0, -0.3]), np.zeros(3)
    return ScenePose(
        ball_m=ball, cup_m=tie, cup_rotation=np.eye(3), rope_m=hanging_rope(tie, ball, 0.4), arm_m=np.empty((0, 3))
    )


def _period_s(camera: Camera, clock: Clock) -> float:
    """Return the time between the first two frames of a recording [s]."""
    first = camera.next_s or 0.0
    clock.wait(first - clock())
    camera.latest(max_age_s=np.inf)
    return (camera.next_s or first) - first


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
    must(stamps == sorted(stamps), f"stamps must not fall: {stamps}")
    must(stamps[-1] > stamps[0], f"new frames must come: {stamps}")
    _check_region(camera, wait, period_s)
    must(_refusal(camera) is not None, "a frame older than max_age_s must raise StaleFrame")
    refusal = _refusal(camera)
    must(refusal is not None and refusal.camera == camera.model.name, "StaleFrame must name its camera")
    must("\n" not in str(refusal), "StaleFrame must be one line")
    camera.close()
    camera.close()


def _refusal(camera: Camera) -> StaleFrame | None:
    try:
        camera.latest(max_age_s=-1.0)
    except StaleFrame as error:
        return error
    return None


def _check_region(camera: Camera, wait: Callable[[float], None], period_s: float) -> None:
    image = whole(camera.model.width_px, camera.model.height_px)
    requested = Region(image.right // 4, image.bottom // 4, image.right // 2, image.bottom // 2)
    for region in (requested, Region(-20, -20, 8, 8), Region(image.right + 5, 0, image.right + 9, 9), None):
        camera.set_region_of_interest(region)
        wait(1.05 * period_s)
        frame = camera.latest(max_age_s=10 * period_s)
        (left, top), (height, width) = frame.origin_px, frame.pixels.shape[:2]
        shown = Region(left, top, left + width, top + height)
        asked = image if region is None else region.within(image)
        must(shown.within(image) == shown and not shown.empty, f"a frame must lie in the image, not at {shown}")
        must(asked.empty or asked.within(shown) == asked, f"a frame must hold the region of interest {asked}")


def _check_whole(camera: Camera, frame: Frame, now_s: float) -> None:
    size = (camera.model.height_px, camera.model.width_px, 3)
    must(frame.pixels.dtype == np.uint8, f"pixels must be uint8, not {frame.pixels.dtype}")
    must(
        frame.pixels.shape == size,
        f"without a region of interest a camera must show its whole image {size}, not {frame.pixels.shape}",
    )
    must(frame.t_s <= now_s + 1e-9, f"a frame of {frame.t_s} s cannot come before it was taken, at {now_s} s")
