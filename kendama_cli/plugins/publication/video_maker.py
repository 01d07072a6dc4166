"""A video of one motion by our own ray caster: the replay's scene as images, slow around the catch."""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import groupby

import cv2
import numpy as np
from numpy.typing import NDArray

from kendama_cli.motion.rotation import matrix_of
from kendama_cli.rendering.background import Floor
from kendama_cli.rendering.kernel_light import TILE
from kendama_cli.rendering.mesh import LinkMesh, unit_cylinder, unit_sphere
from kendama_cli.rendering.moving import SceneSampler, Shot
from kendama_cli.rendering.raycast import Raycaster
from kendama_cli.rendering.scene import ScenePose, hanging_rope
from kendama_cli.report.replay.performance import Frames, Performance
from kendama_cli.robot_model.colours import BALL_RGB, CUP_RGB, Rgb
from kendama_cli.schema.arrays import Array
from kendama_cli.schema.foxglove import Solid
from kendama_cli.settings.camera import AppearanceSettings, LightingSettings, LightSettings
from kendama_cli.settings.game import GameSettings
from kendama_cli.system.compiled import compiled
from kendama_cli.vision.cameras.camera_model import CameraModel, looking_at

WIDTH_PX, HEIGHT_PX, RATE_HZ = 1280, 720, 60.0
SLOWER = 8.0
BEFORE_S, AFTER_S, EASE_S = 0.34, 0.16, 0.25
"""Slow motion lasts from so long before the catch to so long after it, and comes and goes within EASE_S."""
REST_S = 0.9
"""Duration of the motion that is shown after the catch."""
LEAD_S = 2.6
"""Duration of the motion that is shown before the catch."""
_SHUTTER_S = 0.004
_FOCAL_PX = 1180.0
_LAMP_M, _LAMP, _AMBIENT = (1.6, 2.4, 4.2), 0.62, 0.5
_ROPE_RGB = (0.2, 0.2, 0.22)
_UNSEEN = (0.0, 0.0, 0.0)
_INK_BGR = (114, 106, 106)


def clock(catch_s: float | None, start_s: float, end_s: float) -> Iterator[tuple[float, float]]:
    """Yield the motion's time and its speed (1: as it was) for every image of the video."""
    if catch_s is not None:
        start_s, end_s = max(start_s, catch_s - LEAD_S), min(end_s, catch_s + REST_S)
    t_s = start_s
    while t_s <= end_s:
        speed = 1.0 if catch_s is None else _speed(t_s - catch_s)
        yield t_s, speed
        t_s += speed / RATE_HZ


def _speed(from_catch_s: float) -> float:
    """Return 1 away from the catch, 1 / SLOWER around it, and a smooth step in between."""
    away = max(-BEFORE_S - from_catch_s, from_catch_s - AFTER_S, 0.0) / EASE_S
    fraction = min(away, 1.0) ** 2 * (3 - 2 * min(away, 1.0))
    return (1 - fraction) / SLOWER + fraction


class MotionScene:
    """The scene of ``motion`` as a virtual camera asks for it; the rope is tied to ``tie_m`` of the cup's own frame."""

    def __init__(self, motion: Performance, tie_m: tuple[float, float, float]) -> None:
        self._motion, self._tie_m = motion, np.array(tie_m)
        self._cup, self._ball = (motion.bodies.names.index(name) for name in ("cup", "ball"))
        held = () if motion.links is None else motion.links.names
        kept = [solid for solid in motion.solids if solid.frame in held]
        grouped = groupby(sorted(kept, key=_look), key=_look)
        self._frames: list[int] = []
        self.meshes: list[LinkMesh] = []
        for (frame, rgb), solids in grouped:
            self._frames.append(held.index(frame))
            self.meshes.append(_joined(list(solids), rgb))

    def __call__(self, t_s: float) -> ScenePose:
        """Return all poses at ``t_s``."""
        positions, rotations = _at(self._motion.bodies, t_s)
        cup, ball, rotation = positions[self._cup], positions[self._ball], rotations[self._cup]
        links = np.empty((0, 3, 4))
        if self._motion.links is not None and self._frames:
            at, rotated = _at(self._motion.links, t_s)
            links = np.concatenate([rotated[self._frames], at[self._frames][:, :, None]], axis=2)
        rope = hanging_rope(cup + rotation @ self._tie_m, ball, self._motion.rope_m, 17)
        return ScenePose(
            ball_m=ball, cup_m=cup, cup_rotation=rotation, rope_m=rope, arm_m=np.empty((0, 3)), links=links
        )


class VideoMaker:
    """Images of ``motion`` with the sizes of ``game``, as the camera ``model`` sees it."""

    def __init__(self, motion: Performance, game: GameSettings) -> None:
        self._scene, self._motion = MotionScene(motion, game.cup.tie_m), motion
        lamps = (LightSettings(position_m=_LAMP_M, irradiance=_LAMP),)
        light = LightingSettings(ambient=_AMBIENT, lamps=lamps, wall_glow=0.0, flicker_hz=0.0, flicker_depth=0.0)
        look = AppearanceSettings(
            ball_rgb=_linear(BALL_RGB),
            ball_pattern="plain",
            ball_second_rgb=_UNSEEN,
            ball_spin_hz=0.0,
            cup_rgb=_linear(CUP_RGB),
            arm_rgb=_UNSEEN,
            rope_rgb=_ROPE_RGB,
            wall_rgb=_UNSEEN,
            wall_image=None,
            table_rgb=_UNSEEN,
            rope_radius_m=0.0025,
            arm_radius_m=0.05,
            wall_y_m=-9.0,
            table_z_m=0.0,
        )
        self.model = _view(motion.start_m, arm=motion.links is not None)
        self._raycaster = Raycaster(self.model, look, light, game, Floor(self.model, light))
        self._sampler = SceneSampler(look, self._scene.meshes)
        self._image = np.empty((HEIGHT_PX, WIDTH_PX, 3), dtype=np.uint8)

    @staticmethod
    def moments(motion: Performance) -> list[tuple[float, float]]:
        """Time and speed of each image of the video."""
        frames = motion.bodies
        end_s = frames.start_s + (len(frames.poses) - 1) / frames.rate_hz
        return list(clock(motion.catch_s, frames.start_s, end_s))

    def image(self, t_s: float, speed: float) -> NDArray[np.uint8]:
        """Return the scene (h, w, 3) at ``t_s``, BGR; exposed for less, and with its speed in text, where slow."""
        half_s = _SHUTTER_S * speed / 2
        moving = self._sampler.moving(self._scene, t_s - half_s, t_s + half_s)
        last = len(moving.ball_m) - 1
        rows = np.full(HEIGHT_PX, last / 2)
        light, changed = self._raycaster.renew(Shot(t_s, moving, rows, float(last), np.ones(HEIGHT_PX)))
        _to_screen(changed, light, _SRGB, self._image)
        image = self._image.copy()
        words = self._motion.label + ("" if speed > 0.99 else f"   1/{1 / speed:.0f} speed")
        cv2.putText(image, words, (36, HEIGHT_PX - 34), cv2.FONT_HERSHEY_DUPLEX, 0.62, _INK_BGR, 1, cv2.LINE_AA)
        return image


def _view(cup_m: Array, *, arm: bool) -> CameraModel:
    """Return the camera, at the viewpoint of the replay."""
    target = cup_m + np.array([0.0, -0.3 if arm else 0.0, -0.2 if arm else -0.1])
    position = target + (2.7 if arm else 1.9) * np.array([0.34, 0.9, 0.26])
    return CameraModel(
        name="video",
        width_px=WIDTH_PX,
        height_px=HEIGHT_PX,
        focal_px=np.array([_FOCAL_PX, _FOCAL_PX]),
        center_px=np.array([(WIDTH_PX - 1) / 2, (HEIGHT_PX - 1) / 2]),
        distortion=np.zeros(5),
        world_to_camera=looking_at(position, target),
        position_in_world_m=position,
    )


def _at(frames: Frames, t_s: float) -> tuple[Array, Array]:
    """Interpolate positions (k, 3) and rotations (k, 3, 3) at ``t_s`` straight between the samples."""
    at = min(max((t_s - frames.start_s) * frames.rate_hz, 0.0), len(frames.poses) - 1.0)
    low = min(math.floor(at), len(frames.poses) - 2)
    mean = frames.poses[low] + (at - low) * (frames.poses[low + 1] - frames.poses[low])
    return mean[:, :3], np.array([matrix_of(rotation) for rotation in mean[:, 3:]])


def _look(solid: Solid) -> tuple[str, tuple[float, float, float]]:
    return solid.frame, solid.rgb


def _joined(solids: list[Solid], rgb: Rgb) -> LinkMesh:
    """Return the solids of one frame and colour as one mesh in that frame; ``rgb`` is as screens show it."""
    vertices, triangles, count = [], [], 0
    for solid in solids:
        points, corners = _surface(solid)
        vertices.append(points @ matrix_of(tuple(solid.rotation_wxyz)).T + np.array(tuple(solid.position_m)))
        triangles.append(corners + count)
        count += len(points)
    return LinkMesh(np.concatenate(vertices), np.concatenate(triangles), _linear(rgb))


def _linear(rgb: Rgb) -> Rgb:
    """Return a colour as screens show it -> the light that the ray caster counts with."""
    red, green, blue = (value**2.2 for value in rgb)
    return red, green, blue


def _surface(solid: Solid) -> tuple[Array, NDArray[np.int64]]:
    """Return the vertices (n, 3) and triangles (m, 3) of a solid in its own frame."""
    if solid.kind == "mesh":
        return np.array([tuple(one) for one in solid.vertices_m]), np.array([tuple(one) for one in solid.triangles])
    size = np.array(tuple(solid.size_m))
    if solid.kind == "sphere":
        points, corners = unit_sphere()
        return points * size / 2, corners
    if solid.kind == "box":
        points = np.array([(x, y, z) for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)])
        quads = ((0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3))
        return points * size, np.array([pick for a, b, c, d in quads for pick in ((a, b, c), (a, c, d))])
    points, corners = unit_cylinder()
    narrowed = points * np.where(points[:, 2:] > 0.5, [solid.top_scale, solid.top_scale, 1.0], 1.0)
    sides = len(points) // 2
    i, j = np.arange(sides), (np.arange(sides) + 1) % sides
    low, high = np.full(sides, 2 * sides), np.full(sides, 2 * sides + 1)
    ends = [np.column_stack([low, j, i]), np.column_stack([high, i + sides, j + sides])]
    closed = np.concatenate([narrowed, [[0.0, 0.0, 0.0], [0.0, 0.0, 1.0]]])
    return (closed - [0.0, 0.0, 0.5]) * size / [2, 2, 1], np.concatenate([corners, *ends])


def _srgb() -> NDArray[np.uint8]:
    """Convert linear light in 4096 steps to a screen's values by IEC 61966-2-1."""
    light = np.linspace(0.0, 1.0, 4096)
    curved = np.where(light <= 0.0031308, 12.92 * light, 1.055 * light ** (1 / 2.4) - 0.055)
    return np.asarray(np.rint(255 * curved), dtype=np.uint8)


_SRGB = _srgb()


@compiled
def _to_screen(tiles: NDArray[np.int64], light: Array, levels: NDArray[np.uint8], out: NDArray[np.uint8]) -> None:
    """Write ``tiles`` of light (h, w, 3), RGB, to ``out`` as BGR by the table ``levels`` of light in [0, 1]."""
    top_level = len(levels) - 1
    across = (light.shape[1] + TILE - 1) // TILE
    for tile in tiles:
        top, left = tile // across * TILE, tile % across * TILE
        for y in range(top, min(top + TILE, light.shape[0])):
            for x in range(left, min(left + TILE, light.shape[1])):
                for i in range(3):
                    out[y, x, i] = levels[int(min(max(light[y, x, 2 - i], 0.0), 1.0) * top_level + 0.5)]
