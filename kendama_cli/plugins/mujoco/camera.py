"""Cameras whose images MuJoCo renders, by OpenGL: a second renderer of the scenes that virtual cameras show."""

from __future__ import annotations

import functools
import os
import sys
from collections.abc import Callable, Sequence
from itertools import pairwise
from typing import Any

import cv2
import numpy as np

from kendama_cli.devices.camera.interface import SceneSource
from kendama_cli.devices.camera.virtual import LightAt, VirtualCameraBlock, open_virtual
from kendama_cli.errors import ConfigError, MissingPartError
from kendama_cli.plugins.mujoco.library import mujoco
from kendama_cli.plugins.mujoco.settings import MujocoCamera
from kendama_cli.plugins.mujoco.shapes import add_cup
from kendama_cli.rendering.scene import ScenePose
from kendama_cli.schema.arrays import Array
from kendama_cli.settings.camera import AppearanceSettings, LightingSettings
from kendama_cli.settings.game import GameSettings
from kendama_cli.vision.cameras.camera_model import CameraModel
from kendama_cli.vision.cameras.region import Region

MOST_GEOMS = 400
NEAR_M, FAR_M = 0.02, 20.0


def open_mujoco_cameras(
    settings: MujocoCamera, models: Sequence[CameraModel], clock: Callable[[], float], scene: SceneSource | None
) -> list[VirtualCameraBlock]:
    """Open cameras that MuJoCo renders, see OpenCameras.

    Raises ConfigError without a ``scene`` and for a rolling shutter, MissingPartError without MuJoCo or OpenGL.
    """
    if scene is None:
        raise ConfigError("camera.kind", "'camera.kind' is 'mujoco', which shows a simulated scene only")
    if settings.sensor.shutter != "global":
        raise ConfigError(
            "camera.sensor.shutter",
            f"'camera.sensor.shutter' is '{settings.sensor.shutter}'; MuJoCo renders all rows at once: choose global",
        )
    return open_virtual(settings, models, clock, scene, functools.partial(_rendered, settings, scene))


def _rendered(settings: MujocoCamera, scene: SceneSource, model: CameraModel) -> LightAt:
    drawn = DrawnScene(model, settings, scene.game, scene.lighting)

    def light_at(t_s: float) -> Callable[[Region], Array]:
        here = model if model.link is None or scene.placed is None else scene.placed(model, t_s)
        light = drawn.light(here, scene.scene(t_s))
        return lambda region: np.ascontiguousarray(light[region.top : region.bottom, region.left : region.right])

    return light_at


class DrawnScene:
    """The scene of a game in OpenGL as ``model`` sees it: its lens distorts what a pinhole camera renders.

    Nothing is blurred, no shadow falls, and links are rods. Raises MissingPartError without OpenGL.
    """

    def __init__(
        self, model: CameraModel, settings: MujocoCamera, game: GameSettings, lighting: LightingSettings
    ) -> None:
        mj, self.model, self._look, self._ball_m = mujoco(), model, settings.appearance, game.ball.radius_m
        self._gamma, self._gain = settings.sensor.gamma, settings.sensor.gain
        self._map, (width, height) = _pinhole(model)
        _open_gl().make_current()
        self._model = _world(game, settings.appearance, lighting, model, (width, height))
        self._data = mj.MjData(self._model)
        self._pixels = np.empty((height, width, 3), dtype=np.uint8)
        self._scene, self._option = mj.MjvScene(self._model, MOST_GEOMS), mj.MjvOption()
        self._scene.flags[mj.mjtRndFlag.mjRND_SHADOW] = 0
        self._view = mj.MjvCamera()
        self._view.type, self._view.fixedcamid = mj.mjtCamera.mjCAMERA_FIXED, 0
        self._renderer = mj.MjrContext(self._model, mj.mjtFontScale.mjFONTSCALE_100)

    def light(self, camera: CameraModel, pose: ScenePose) -> Array:
        """Return the linear light (h, w, 3), red green blue, of ``pose`` for ``camera``: this one, in the world."""
        mj, data = mujoco(), self._data
        _open_gl().make_current()
        mj.mjr_setBuffer(mj.mjtFramebuffer.mjFB_OFFSCREEN, self._renderer)  # another camera may have set its own
        right, down, ahead = camera.world_to_camera
        for number, (place_m, axes) in enumerate(
            ((pose.cup_m, pose.cup_rotation), (camera.position_in_world_m, np.column_stack([right, -down, -ahead])))
        ):
            data.mocap_pos[number] = place_m
            mj.mju_mat2Quat(data.mocap_quat[number], np.ascontiguousarray(axes, dtype=np.float64).ravel())
        mj.mj_kinematics(self._model, data)
        mj.mj_camlight(self._model, data)
        mj.mjv_updateScene(self._model, data, self._option, None, self._view, mj.mjtCatBit.mjCAT_ALL.value, self._scene)
        self._add_ball(pose.ball_m)
        self._add_rods(pose.rope_m, self._look.rope_radius_m, self._look.rope_rgb)
        self._add_rods(pose.arm_m, self._look.arm_radius_m, self._look.arm_rgb)
        height, width = self._pixels.shape[:2]
        view = mj.MjrRect(0, 0, width, height)
        mj.mjr_render(view, self._scene, self._renderer)
        mj.mjr_readPixels(self._pixels, None, view, self._renderer)
        upright = np.ascontiguousarray(self._pixels[::-1])
        seen = cv2.remap(upright, *self._map, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
        return np.asarray((seen / 255.0) ** self._gamma / self._gain)

    def _add_ball(self, ball_m: Array) -> None:
        mj, size = mujoco(), np.full(3, self._ball_m)
        colour = _shown(self._look.ball_rgb)
        mj.mjv_initGeom(self._next(), mj.mjtGeom.mjGEOM_SPHERE, size, ball_m, np.eye(3).ravel(), colour)

    def _add_rods(self, points_m: Array, radius_m: float, rgb: tuple[float, float, float]) -> None:
        mj, capsule = mujoco(), mujoco().mjtGeom.mjGEOM_CAPSULE
        for start, end in pairwise(points_m):
            geom = self._next()
            mj.mjv_initGeom(geom, capsule, np.zeros(3), np.zeros(3), np.eye(3).ravel(), _shown(rgb))
            mj.mjv_connector(geom, capsule, radius_m, start, end)

    def _next(self) -> Any:
        self._scene.ngeom += 1
        return self._scene.geoms[self._scene.ngeom - 1]


def _pinhole(model: CameraModel) -> tuple[tuple[Array, Array], tuple[int, int]]:
    """Return the pixels of a centred pinhole image that the pixels of ``model`` see, as maps (h, w), and its size.

    Its focal length is the camera's larger one, so that no detail is lost; a pixel's centre is at a whole number.
    """
    columns, rows = np.meshgrid(np.arange(model.width_px), np.arange(model.height_px))
    seen = model.undistort(np.column_stack([columns.ravel(), rows.ravel()]).astype(np.float64))
    focal = float(model.focal_px.max())
    across, down = (seen.reshape(model.height_px, model.width_px, 2) * focal).transpose(2, 0, 1)
    width, height = (2 * int(np.ceil(np.abs(one).max() + 1.0)) for one in (across, down))
    maps = (across + (width - 1) / 2).astype(np.float32), (down + (height - 1) / 2).astype(np.float32)
    return maps, (width, height)


@functools.cache
def _open_gl() -> Any:
    """Make the process's OpenGL context: EGL, which needs no display, unless MUJOCO_GL names another.

    All cameras share it: what one that is forgotten gives back is then its own.
    """
    mj = mujoco()
    try:
        if sys.platform == "linux" and "MUJOCO_GL" not in os.environ:
            from mujoco.egl import GLContext  # noqa: PLC0415 - an extra
        else:
            GLContext = mj.GLContext
        context = GLContext(16, 16)  # images are rendered off the screen
        context.make_current()
        mj.MjrContext(mj.MjModel.from_xml_string("<mujoco/>"), mj.mjtFontScale.mjFONTSCALE_100)
    except Exception as error:  # what a missing library raises is no one's promise
        raise MissingPartError(
            "OpenGL",
            f"camera=mujoco needs OpenGL, which does not start here ({' '.join(str(error).split())[:120]}); install "
            "Mesa's EGL (libegl1, libgl1-mesa-dri), or use camera=virtual",
        ) from error
    return context


def _world(
    game: GameSettings,
    look: AppearanceSettings,
    lighting: LightingSettings,
    model: CameraModel,
    size_px: tuple[int, int],
) -> Any:
    """Build wall, table, lamps, the cup and the camera; cup and camera are set for each image, in this order."""
    mj = mujoco()
    spec = mj.MjSpec()
    spec.visual.global_.offwidth, spec.visual.global_.offheight = size_px
    spec.visual.quality.numslices = spec.visual.quality.numstacks = 64  # a sphere of 28 is 0.05 px too small between
    spec.stat.extent = 1.0
    spec.visual.map.znear, spec.visual.map.zfar = NEAR_M, FAR_M
    spec.visual.headlight.active = 0
    spec.visual.headlight.ambient = [0.0] * 3
    world, plane = spec.worldbody, mj.mjtGeom.mjGEOM_PLANE
    world.add_geom(type=plane, size=[FAR_M, FAR_M, 1], pos=[0, 0, look.table_z_m], rgba=_shown(look.table_rgb))
    towards_us = [np.sqrt(0.5), np.sqrt(0.5), 0.0, 0.0]  # z to -y
    world.add_geom(
        type=plane, size=[FAR_M, FAR_M, 1], pos=[0, look.wall_y_m, 0], quat=towards_us, rgba=_shown(look.wall_rgb)
    )
    for number, lamp in enumerate(lighting.lamps):
        place = np.array(lamp.position_m)
        world.add_light(
            pos=place,
            dir=-place / np.linalg.norm(place),
            cutoff=90.0,
            exponent=0.0,
            diffuse=[lamp.irradiance] * 3,
            ambient=[lighting.ambient if number == 0 else 0.0] * 3,
            specular=[0.0] * 3,
        )
    cup = world.add_body(name="cup", mocap=True)
    add_cup(mj, cup, game.cup)
    for geom in cup.geoms:
        geom.rgba = _shown(look.cup_rgb)
    height_m = size_px[1] / float(model.focal_px.max())  # at 1 m
    eye = world.add_body(name="camera", mocap=True)
    eye.add_camera(name=model.name, fovy=float(np.degrees(2 * np.arctan(height_m / 2))))
    return spec.compile()


def _shown(rgb: tuple[float, float, float]) -> Any:
    """Return a reflectance as OpenGL's colour (4,), whose numbers are not linear."""
    return np.array([*(value ** (1 / 2.2) for value in rgb), 1.0], dtype=np.float32)
