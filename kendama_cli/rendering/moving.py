"""The scene over the time that one frame takes: poses at a few times, between which all moves linearly."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from kendama_cli.errors import ConfigError
from kendama_cli.rendering.mesh import LinkMesh, Surface, unit_cylinder, unit_sphere
from kendama_cli.rendering.scene import Scene, ScenePose
from kendama_cli.schema.arrays import Array
from kendama_cli.settings.camera import AppearanceSettings

STEP_S = 0.002
"""Step between two times; a ball in free flight bends away from the straight line by 5 um meanwhile."""


@dataclass(frozen=True)
class Part:
    """A moving mesh: ``into`` (k, 3, 4) takes world points into its frame at each time.

    ``centre_m`` and ``reach_m`` bound it at all times by a sphere; no point of it goes farther than ``travel_m``.
    """

    surface: Surface
    into: Array
    centre_m: Array
    reach_m: float
    travel_m: float


@dataclass(frozen=True)
class Moving:
    """Bodies at k >= 2 times, equally spaced over a frame's time."""

    ball_m: Array
    """(k, 3)"""
    cup_m: Array
    """(k, 3)"""
    cup_rotation: Array
    """(k, 3, 3)"""
    rope_m: Array
    """(k, n, 3)"""
    parts: tuple[Part, ...]


@dataclass(frozen=True)
class Shot:
    """Settings of one frame: the bodies, the exposure time of each row, and the strength of the lamps then.

    ``row_tau`` (h,) is each row's mid-exposure in [0, k - 1] of the k times of ``moving``, ``spread_tau`` the
    exposure on that scale, ``strength`` (h,) the lamps' mean strength over each row's exposure. A patterned ball has
    rotated since time 0 until ``t_s``.
    """

    t_s: float
    moving: Moving
    row_tau: Array
    spread_tau: float
    strength: Array


class SceneSampler:
    """Sampler of a scene's poses, and of its robot as meshes: links given once, and rods between joints."""

    def __init__(self, appearance: AppearanceSettings, links: Sequence[LinkMesh]) -> None:
        self._radius_m, self._arm_rgb = appearance.arm_radius_m, appearance.arm_rgb
        self._links = [Surface(mesh) for mesh in links]

    # made at the first arm: a scene without one needs no meshes
    @cached_property
    def _rod_surface(self) -> Surface:
        return Surface(LinkMesh(*unit_cylinder(), self._arm_rgb), convex=True)

    @cached_property
    def _joint_surface(self) -> Surface:
        return Surface(LinkMesh(*unit_sphere(), self._arm_rgb), convex=True)

    def moving(self, scene: Scene, first_s: float, last_s: float) -> Moving:
        """Return the scene from ``first_s`` to ``last_s``; raises ConfigError where its links are not the camera's."""
        count = 1 + max(1, math.ceil((last_s - first_s) / STEP_S - 1e-9))
        poses = [scene(float(t_s)) for t_s in np.linspace(first_s, last_s, count)]
        return Moving(
            ball_m=np.array([pose.ball_m for pose in poses], dtype=np.float64),
            cup_m=np.array([pose.cup_m for pose in poses], dtype=np.float64),
            cup_rotation=np.array([pose.cup_rotation for pose in poses], dtype=np.float64),
            rope_m=np.array([pose.rope_m for pose in poses], dtype=np.float64),
            parts=tuple(self._parts(poses)),
        )

    def _parts(self, poses: Sequence[ScenePose]) -> list[Part]:
        links = np.array([pose.links for pose in poses], dtype=np.float64)
        if links.shape[1] not in (0, len(self._links)):
            raise ConfigError(
                "camera",
                f"the scene gives poses of {links.shape[1]} links, but the camera was given {len(self._links)} meshes: "
                "give both in the same order and number",
            )
        made = [(surface, links[:, i]) for i, surface in enumerate(self._links[: links.shape[1]])]
        joints = np.array([pose.arm_m for pose in poses], dtype=np.float64)
        for i in range(joints.shape[1]):
            ball = np.tile(np.eye(3) * self._radius_m, (len(poses), 1, 1))
            made.append((self._joint_surface, np.dstack([ball, joints[:, i, :, None]])))
        for i in range(joints.shape[1] - 1):
            rod = _rod(joints[:, i], joints[:, i + 1], self._radius_m)
            if rod is not None:
                made.append((self._rod_surface, rod))
        return _parts(made)


def _parts(placed: Sequence[tuple[Surface, Array]]) -> list[Part]:
    """Make parts from their affine maps [A | p] (k, 3, 4) into the world, all at once: calls cost more than sums."""
    if not placed:
        return []
    maps = np.array([one for _, one in placed])
    inverse = np.linalg.inv(maps[..., :3])
    into = np.concatenate([inverse, -inverse @ maps[..., 3:]], axis=3)
    boxes = np.array([surface.box for surface, _ in placed])
    world = (maps[..., :3] @ boxes[:, None] + maps[..., 3:]).swapaxes(2, 3)
    centre = world.mean(axis=(1, 2))
    reach = np.linalg.norm(world - centre[:, None, None], axis=3).max(axis=(1, 2))
    travel = np.linalg.norm(np.diff(world, axis=1), axis=3).sum(axis=1).max(axis=1)
    bounds = zip(centre, reach.tolist(), travel.tolist(), strict=True)
    return [Part(surface, into[i], *bound) for i, ((surface, _), bound) in enumerate(zip(placed, bounds, strict=True))]


def _rod(a_m: Array, b_m: Array, radius_m: float) -> Array | None:
    """Return maps (k, 3, 4) of the unit cylinder onto the rod ``a_m`` to ``b_m`` (k, 3); None if it has no length."""
    along = b_m - a_m
    length = np.linalg.norm(along, axis=1, keepdims=True)
    if length.min() < 1e-9:
        return None
    aside = np.eye(3)[np.argmin(np.abs(along[0]))]  # one choice for all times, so that the frame does not jump
    first = np.cross(along, aside)
    first *= radius_m / np.linalg.norm(first, axis=1, keepdims=True)
    second = np.cross(along / length, first)
    return np.stack([first, second, along, a_m], axis=2)
