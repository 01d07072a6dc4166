"""From a camera's settings to its model."""

from __future__ import annotations

import numpy as np

from kendama_cli.artifacts.checks import Array
from kendama_cli.errors import ConfigError
from kendama_cli.settings.camera import CameraModelSettings
from kendama_cli.vision.camera_model import CameraModel, looking_at


def camera_model(settings: CameraModelSettings) -> CameraModel:
    """The calibrated model; raises ConfigError where the pose cannot be."""
    if settings.rotation_wxyz is not None:
        rotation = _camera_axes(settings.rotation_wxyz).T
    else:
        try:
            rotation = looking_at(settings.position_m, np.asarray(settings.look_at_m))
        except ValueError as error:
            raise ConfigError("camera.cameras", f"camera '{settings.name}': {error}; move look_at_m") from None
    return CameraModel(
        name=settings.name,
        width_px=settings.width_px,
        height_px=settings.height_px,
        focal_px=np.array(settings.focal_px),
        center_px=np.array(settings.center_px),
        distortion=np.array(settings.distortion),
        world_to_camera=rotation,
        position_in_world_m=np.array(settings.position_m),
    )


def _camera_axes(wxyz: tuple[float, float, float, float]) -> Array:
    length = float(np.linalg.norm(wxyz))
    if abs(length - 1) > 1e-3:
        raise ConfigError("camera.cameras", f"rotation_wxyz {list(wxyz)} has length {length:.4g}; it must be 1")
    w, x, y, z = np.array(wxyz) / length
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )
