"""Settings as shipped, and cameras to look through."""

import functools

import numpy as np

from kendama_cli.devices.camera.calibration import camera_model
from kendama_cli.schema.settings import build
from kendama_cli.settings.camera import LightingSettings, VirtualCamera
from kendama_cli.settings.game import GameSettings
from kendama_cli.vision.cameras.camera_model import CameraModel, looking_at
from kendama_cli.vision.detection.interface import Detector, SearchHint, Sighting
from kendama_cli.vision.settings import PredictSettings
from tests.shipped_conf import plain


@functools.cache
def virtual() -> VirtualCamera:
    return build(VirtualCamera, plain("camera", "virtual"), "camera")


@functools.cache
def lighting(name: str) -> LightingSettings:
    return build(LightingSettings, plain("lighting", name), "lighting")


@functools.cache
def game() -> GameSettings:
    return build(GameSettings, plain("game", "kendama"), "game")


@functools.cache
def predict() -> PredictSettings:
    return build(PredictSettings, plain("predict", "flights"), "predict")


def first_found(detector: Detector, pixels, origin_px=(0, 0), expected_px=None) -> Sighting | None:
    """The most likely candidate, near ``expected_px`` where that is given."""
    hint = None if expected_px is None else SearchHint(np.asarray(expected_px), 14.0)
    return next(detector.candidates(pixels, origin_px, hint), None)


def shipped_models() -> list[CameraModel]:
    return [camera_model(one) for one in virtual().cameras]


def stereo(distortion=(-0.1, 0.02, 0.001, -0.0005, 0.0)) -> list[CameraModel]:
    """The stereo pair of FACTS: f = 600 px, 0.5 m baseline, 1.5 m away."""
    made = []
    for name, x in (("left", -0.25), ("right", 0.25)):
        position = np.array([x, -1.5, 0.25])
        made.append(
            CameraModel(
                name=name,
                width_px=640,
                height_px=480,
                focal_px=np.array([600.0, 600.0]),
                center_px=np.array([319.5, 239.5]),
                distortion=np.array(distortion),
                world_to_camera=looking_at(position, (0.0, 0.0, 0.2)),
                position_in_world_m=position,
            )
        )
    return made
