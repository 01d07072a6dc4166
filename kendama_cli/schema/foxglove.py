"""Foxglove's messages as light dataclasses, of which ``schema/messages.py`` makes protobuf.

Standard library only: the declarations of stages, and so the command line, import this. A field of several numbers is
a Collection, so that an array can be given without being copied.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass
from typing import Literal

UPRIGHT_WXYZ = (1.0, 0.0, 0.0, 0.0)


@dataclass(frozen=True)
class FrameTransform:
    """foxglove.FrameTransform: where frame ``child`` is in frame ``parent``."""

    parent: str
    child: str
    position_m: Collection[float]
    """(3,)"""
    rotation_wxyz: Collection[float] = UPRIGHT_WXYZ
    """(4,), a unit quaternion"""


@dataclass(frozen=True)
class JointStates:
    """foxglove.JointStates: one value per joint of ``names``, in the chain's order; None for what was not measured."""

    names: Collection[str]
    position_rad: Collection[float]
    velocity_rad_s: Collection[float] | None = None
    effort_nm: Collection[float] | None = None


@dataclass(frozen=True)
class CompressedImage:
    """foxglove.CompressedImage: an encoded image (``format`` such as jpeg or png) seen from frame ``frame``."""

    frame: str
    format: str
    data: bytes


@dataclass(frozen=True)
class FrameTransforms:
    """foxglove.FrameTransforms: where the frames ``children`` are in frame ``parent`` at one time."""

    parent: str
    children: Collection[str]
    positions_m: Collection[Collection[float]]
    """(n, 3)"""
    rotations_wxyz: Collection[Collection[float]]
    """(n, 4), unit quaternions"""


SolidKind = Literal["box", "cylinder", "mesh", "sphere"]


@dataclass(frozen=True)
class Solid:
    """One body that is drawn; ``name`` says what it is, and it moves with ``frame``.

    ``position_m`` and ``rotation_wxyz`` pose it in the frame. ``size_m`` (3,) is its extent along its own axes, a
    cylinder's axis being z; ``top_scale`` narrows a cylinder's upper end. A mesh has ``vertices_m`` (n, 3) and
    ``triangles`` (m, 3) into them instead of a size.
    """

    frame: str
    name: str
    kind: SolidKind
    rgb: tuple[float, float, float]
    size_m: Collection[float] = (1.0, 1.0, 1.0)
    position_m: Collection[float] = (0.0, 0.0, 0.0)
    rotation_wxyz: Collection[float] = UPRIGHT_WXYZ
    top_scale: float = 1.0
    vertices_m: Collection[Collection[float]] = ()
    triangles: Collection[Collection[int]] = ()


@dataclass(frozen=True)
class SceneUpdate:
    """foxglove.SceneUpdate: the solids of a scene, one entity each, from now on."""

    solids: tuple[Solid, ...]
