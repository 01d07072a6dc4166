"""Model of a camera, from its settings or a calibration file."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from kendama_cli.errors import ConfigError, InputError
from kendama_cli.motion.rotation import matrix_of
from kendama_cli.schema.arrays import Array, NotUnitError, unit_quaternions
from kendama_cli.schema.plain_yaml import load_yaml
from kendama_cli.schema.settings import build
from kendama_cli.settings.camera import CameraModelSettings, CameraSettings
from kendama_cli.vision.cameras.camera_model import CameraModel, looking_at

MAKE_ONE = "make one with 'kendama camera calibrate'"


def camera_models(settings: CameraSettings, *, carried: bool = False) -> list[CameraModel]:
    """Return all cameras of the settings, with the values of ``settings.calibration`` where one is given.

    Raises ConfigError where settings contradict each other, or a camera is on a link and may not be ``carried``,
    InputError where the file is no calibration of these cameras.
    """
    cameras = settings.cameras
    if not cameras:
        raise ConfigError("camera.cameras", "'camera.cameras' is empty: give at least one calibrated camera")
    names = [camera.name for camera in cameras]
    if len(set(names)) < len(names):
        raise ConfigError("camera.cameras", f"'camera.cameras' has the names {', '.join(names)}: make each name unique")
    if settings.calibration is None:
        return [camera_model(camera, carried=carried) for camera in cameras]
    known = {camera.name: camera for camera in read_calibration(settings.calibration)}
    missing = [name for name in names if name not in known]
    if missing:
        raise InputError(
            settings.calibration,
            f"it calibrates the cameras {', '.join(known)}, but 'camera.cameras' names '{missing[0]}'",
            remedy="calibrate all cameras in one go, or give 'camera.cameras' these names",
        )
    return [camera_model(known[name], carried=carried) for name in names]


def read_calibration(path: str) -> list[CameraModelSettings]:
    """Return the cameras of a calibration file; raises InputError where it is none."""
    try:
        content = load_yaml(Path(path).read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        raise InputError(path, f"it cannot be read as a calibration ({reason})", remedy=MAKE_ONE) from None
    entries = content.get("cameras") if isinstance(content, dict) else None
    if not isinstance(entries, list) or not entries:
        raise InputError(path, "it has no list 'cameras'", remedy=MAKE_ONE)
    made = []
    for number, entry in enumerate(entries):
        try:
            made.append(build(CameraModelSettings, entry, f"cameras.{number}"))
        except ConfigError as error:
            raise InputError(path, str(error), remedy=MAKE_ONE) from None
    return made


def camera_model(settings: CameraModelSettings, *, carried: bool = False) -> CameraModel:
    """Return the calibrated model.

    Raises ConfigError where the pose cannot be, or is in a link where no arm tells how it is ``carried``.
    """
    if settings.link is not None and not carried:
        raise ConfigError(
            "camera.cameras",
            f"camera '{settings.name}' is on link '{settings.link}', but no arm carries it here; use it in 'transfer', "
            "or give cameras that stand still (link: null)",
        )
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
        lens=settings.lens,
        readout_s=settings.readout_s,
        link=settings.link,
    )


def _camera_axes(wxyz: tuple[float, float, float, float]) -> Array:
    try:
        return matrix_of(unit_quaternions(wxyz))
    except NotUnitError as wrong:
        problem = f"rotation_wxyz {list(wxyz)} has length {wrong.length:.4g}; it must be 1"
        raise ConfigError("camera.cameras", problem) from None
