"""Log messages that several stages write: a rollout of the swing-up, a detection in an image, a wrench.

Standard library only. A message's fields are numbered in their order in the file: append, never reorder.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class RolloutMessage:
    """One learning rollout of the swing-up, at its end."""

    index: int
    explored: bool
    reward: float
    success: bool
    duration_s: float
    peak_displacement_m: float
    half_swings: int


@dataclass(frozen=True)
class DetectionMessage:
    """Where one camera saw the ball in one image; nan where it was not ``seen``."""

    flight: int
    camera: str
    u_px: float
    v_px: float
    radius_px: float
    seen: bool


@dataclass(frozen=True)
class WrenchMessage:
    """What a wrist's sensor measures."""

    force_x_n: float
    force_y_n: float
    force_z_n: float
    torque_x_nm: float
    torque_y_nm: float
    torque_z_nm: float
