"""Log messages that several stages write: a rollout of the swing-up, a detection in an image, a wrench, a command.

Standard library only. A message's fields are numbered in their order in the file: append, never reorder.
"""

from __future__ import annotations

from collections.abc import Collection
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
    """Detection of the ball in one image of one camera; nan where it was not ``seen``.

    ``covariance_px2`` (4,) of the centre, row by row, as the detector states it; empty where it was not seen.
    """

    flight: int
    camera: str
    u_px: float
    v_px: float
    radius_px: float
    seen: bool
    covariance_px2: Collection[float] = ()


@dataclass(frozen=True)
class WrenchMessage:
    """Measurement of a wrist's force and torque sensor."""

    force_x_n: float
    force_y_n: float
    force_z_n: float
    torque_x_nm: float
    torque_y_nm: float
    torque_z_nm: float


@dataclass(frozen=True)
class ServoMessage:
    """Servo of n ``joints`` behind their commands, as found in a motion: the fields of ServoModel, (n,) each."""

    joints: Collection[str]
    dead_time_s: float
    lag_s: Collection[float]
    lag_sigma_s: Collection[float]
    sag_rad_nm: Collection[float]
    offset_rad: Collection[float]


@dataclass(frozen=True)
class JointExchangeMessage:
    """One control period: what was really sent to n ``joints``, after all limits, and what was measured after it (n,).

    ``sent_nm`` is the effort that was added to the torque of the robot's own controller.
    """

    joints: Collection[str]
    sent_rad: Collection[float]
    sent_rad_s: Collection[float]
    sent_nm: Collection[float]
    measured_rad: Collection[float]
    measured_rad_s: Collection[float]
    measured_nm: Collection[float]


@dataclass(frozen=True)
class ReplayMessage:
    """One game as another physics can play it again: the body that was sampled for it, and the paths of cup and ball.

    ``t_s`` (n,) counts from the game's start, ``cup_m``, ``cup_axis`` and ``ball_m`` (3 n) are positions of the cup and
    of the ball and the cup's unit axis in the world, one after another. Crossings of the rim's plane count from
    ``since_s`` on; ``miss_m`` is nan where there was none. ``rope_kg`` is 0 but in older logs: our rope has no mass.
    """

    index: int
    rope_m: float
    rope_kg: float
    ball_kg: float
    drag_n_s_m: float
    drag_n_s2_m2: float
    restitution: float
    since_s: float
    caught: bool
    miss_m: float
    t_s: Collection[float]
    cup_m: Collection[float]
    cup_axis: Collection[float]
    ball_m: Collection[float]
