"""Cameras as bodies of a scene that is looked at: where they stand, and what they see."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise

import numpy as np

from kendama_cli.devices.camera.calibration import camera_models
from kendama_cli.motion.rotation import quaternion_of
from kendama_cli.robot_model.arm_scene import WORLD, Pose
from kendama_cli.robot_model.colours import JOINT_RGB, STAND_RGB
from kendama_cli.robot_model.cup import cup_frame
from kendama_cli.schema.arrays import Array
from kendama_cli.schema.foxglove import Solid
from kendama_cli.settings.camera import CameraSettings
from kendama_cli.vision.cameras.camera_model import CameraModel

SEEN_M = 0.3
"""Distance from the camera at which its field of view is drawn."""
_BODY_M, _LENS_M, _WIRE_M = (0.055, 0.045, 0.09), (0.04, 0.04, 0.04), 0.004


def camera_solids(cameras: CameraSettings, origin_m: Array, holder: Callable[[str], tuple[str, Pose]]) -> list[Solid]:
    """Return a box, a lens and the edges of the view for every camera; they are calibrated about ``origin_m`` (3,).

    A camera on a link moves with its ``holder``: the name of a drawn frame, and the link's pose in it.
    """
    solids = []
    for model in camera_models(cameras, carried=True):
        if model.link is None:
            solids += _camera(model, WORLD, origin_m)
        else:
            frame, pose = holder(model.link)
            solids += _camera(model.carried(*pose), frame, np.zeros(3))
    return solids


def _camera(model: CameraModel, frame: str, origin_m: Array) -> list[Solid]:
    position = np.asarray(model.position_in_world_m) + origin_m
    rotation = model.world_to_camera.T
    ahead, wxyz = rotation[:, 2], quaternion_of(rotation)
    right, low = model.width_px - 0.5, model.height_px - 0.5
    corners = model.rays([(-0.5, -0.5), (right, -0.5), (right, low), (-0.5, low)])
    far = [position + SEEN_M * corner for corner in corners]
    wires = [*((position, end) for end in far), *pairwise([*far, far[0]])]
    return [
        Solid(frame, "camera", "box", JOINT_RGB, _BODY_M, position - 0.065 * ahead, wxyz),
        Solid(frame, "camera", "cylinder", JOINT_RGB, _LENS_M, position - 0.01 * ahead, wxyz),
        *(_wire(frame, start, end) for start, end in wires),
    ]


def _wire(frame: str, start_m: Array, end_m: Array) -> Solid:
    along = end_m - start_m
    size = (_WIRE_M, _WIRE_M, float(np.linalg.norm(along)))
    rotation = quaternion_of(cup_frame(tuple(along.tolist())))
    return Solid(frame, "view", "cylinder", STAND_RGB, size, (start_m + end_m) / 2, rotation)
