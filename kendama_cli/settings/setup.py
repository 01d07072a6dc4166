"""Measurements of a laboratory, each with its uncertainty: the content of a setup.yaml."""

from __future__ import annotations

from dataclasses import dataclass

from kendama_cli.schema.settings import setting
from kendama_cli.settings.camera import CameraModelSettings

Triple = tuple[float, float, float]
SIGMAS_95 = 1.96
"""Standard deviations on either side of the mean that hold 95 % of a normal distribution."""


@dataclass(frozen=True)
class MeasuredNumber:
    """A number and how far it may be off."""

    value: float = setting("measured value")
    sigma: float = setting("standard deviation", at_least=0)
    source: str = setting("method and data of the measurement")


@dataclass(frozen=True)
class MeasuredPlace:
    """A place [m], or an offset."""

    value: Triple = setting("measured value [m]")
    sigma: Triple = setting("standard deviations [m]", at_least=0)
    source: str = setting("method and data of the measurement")


@dataclass(frozen=True)
class MeasuredDrag:
    """Force = -(k1 + k2 |v|) v of ball and string; k1 and k2 trade with each other, k1 + 3 k2 is known best."""

    linear_n_s_m: float = setting("k1 [N s/m]", at_least=0)
    quadratic_n_s2_m2: float = setting("k2 [N s^2/m^2]", at_least=0)
    at_3_m_s: float = setting("k1 + 3 k2 [N s/m]", above=0)
    sigma_at_3_m_s: float = setting("standard deviation [N s/m]", at_least=0)
    source: str = setting("method and data of the measurement")


@dataclass(frozen=True)
class PlacedCamera:
    """A camera's calibration with its pose in the robot's world."""

    camera: CameraModelSettings = setting("lens and pose")
    sigma_m: Triple = setting("standard deviations of the pose's position, along the world's axes [m]", at_least=0)
    sigma_rad: Triple = setting("standard deviations of its rotation, about the world's axes [rad]", at_least=0)
    source: str = setting("method and data of the measurement")


@dataclass(frozen=True)
class LaboratorySetup:
    """Everything that was measured; None for what was not."""

    rope_m: MeasuredNumber | None = setting("length of the rope [m]")
    drag: MeasuredDrag | None = setting("air drag of ball and rope")
    camera_delay_s: MeasuredNumber | None = setting("delay from mid-exposure to an image's arrival [s]")
    marker_to_cup_m: MeasuredPlace | None = setting(
        "offset of the cup's tie point from the printed marker's centre [m]"
    )
    body_to_cup_m: MeasuredPlace | None = setting("offset of the cup's tie point from the tracked body's origin [m]")
    cameras: tuple[PlacedCamera, ...] | None = setting("cameras in the robot's world")
