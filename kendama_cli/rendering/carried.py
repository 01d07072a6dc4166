"""Images of a camera that the arm carries: the scene as the camera sees it move, and only the pixels asked for."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from kendama_cli.rendering.moving import Shot
from kendama_cli.rendering.raycast import Raycaster
from kendama_cli.rendering.scene import Scene, ScenePose
from kendama_cli.schema.arrays import Array
from kendama_cli.vision.cameras.camera_model import CameraModel, PlaceCamera
from kendama_cli.vision.cameras.region import Region, whole


def held_still(scene: Scene, placed: PlaceCamera, model: CameraModel, t_s: float) -> tuple[CameraModel, Scene]:
    """Return the camera where it is at ``t_s``, and the scene that moves before it as if it stayed there.

    A world point p is seen at time t in the direction R(t) (p - o(t)); it stands at o + R^T R(t) (p - o(t)) for the
    camera (R, o) of ``t_s``. Lamps and background stay: the blur is that of the bodies.
    """
    still = placed(model, t_s)

    def seen(at_s: float) -> ScenePose:
        now = placed(model, at_s)
        rotation = still.world_to_camera.T @ now.world_to_camera
        return scene(at_s).moved(rotation, still.position_in_world_m - rotation @ now.position_in_world_m)

    return still, seen


def window_light(make: Callable[[CameraModel], Raycaster], model: CameraModel, shot: Shot, region: Region) -> Array:
    """Return the light (h, w, 3) in ``region`` by a camera that has these pixels alone.

    Every frame has a background of its own, which costs more than the bodies do: that of the region is enough.
    """
    width, height = region.right - region.left, region.bottom - region.top
    window = replace(model, width_px=width, height_px=height, center_px=model.center_px - (region.left, region.top))
    rows = slice(region.top, region.bottom)
    part = replace(shot, row_tau=shot.row_tau[rows], strength=shot.strength[rows])
    return make(window).render(part, whole(width, height))
