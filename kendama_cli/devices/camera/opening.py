"""Opening all cameras of a configuration."""

from __future__ import annotations

from collections.abc import Callable

from kendama_cli.devices.camera.calibration import camera_models
from kendama_cli.devices.camera.interface import Camera, SceneSource
from kendama_cli.settings.camera import CAMERAS, CameraSettings


def open_cameras(settings: CameraSettings, clock: Callable[[], float], scene: SceneSource | None) -> list[Camera]:
    """Open all cameras, calibrated, on one ``clock`` [s]; only rendered ones need a ``scene``.

    Raises ConfigError where the settings contradict each other, InputError where a file cannot be used, and
    MissingPartError where a device is not there.
    """
    return list(CAMERAS.maker(settings.kind)(settings, camera_models(settings), clock, scene))
