"""Foxglove's messages as light dataclasses, of which ``schema/messages.py`` makes protobuf.

Standard library only: the declarations of stages, and so the command line, import this. A field of several numbers is
a Collection, so that an array can be given without being copied.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass

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
