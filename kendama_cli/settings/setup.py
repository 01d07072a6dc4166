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

    value: float = setting("Measured value.")
    sigma: float = setting("Standard deviation of the measured value.", at_least=0)
    source: str = setting("Method and data of the measurement.")


@dataclass(frozen=True)
class MeasuredPlace:
    """A place [m], or an offset."""

    value: Triple = setting("Measured position or offset [m].")
    sigma: Triple = setting("Standard deviations per axis [m].", at_least=0)
    source: str = setting("Method and data of the measurement.")


@dataclass(frozen=True)
class MeasuredDrag:
    """Force = -(k1 + k2 |v|) v of ball and string; k1 and k2 trade with each other, k1 + 3 k2 is known best."""

    linear_n_s_m: float = setting("Linear coefficient k1 of the drag [N s/m].", at_least=0)
    quadratic_n_s2_m2: float = setting("Quadratic coefficient k2 of the drag [N s^2/m^2].", at_least=0)
    at_3_m_s: float = setting("Drag per velocity at 3 m/s, k1 + 3 k2 [N s/m].", above=0)
    sigma_at_3_m_s: float = setting("Standard deviation of the drag per velocity at 3 m/s [N s/m].", at_least=0)
    source: str = setting("Method and data of the measurement.")


@dataclass(frozen=True)
class PlacedCamera:
    """A camera's calibration with its pose in the robot's world, or in a link."""

    camera: CameraModelSettings = setting("Lens and pose of the camera.")
    sigma_m: Triple = setting(
        "Standard deviations of the camera's position, along the axes of the world, or its link [m].", at_least=0
    )
    sigma_rad: Triple = setting(
        "Standard deviations of the camera's rotation, about the axes of the world, or its link [rad].", at_least=0
    )
    source: str = setting("Method and data of the measurement.")


@dataclass(frozen=True)
class LaboratorySetup:
    """Everything that was measured; None for what was not."""

    rope_m: MeasuredNumber | None = setting("Measured length of the rope [m].")
    drag: MeasuredDrag | None = setting("Measured air drag of ball and rope.")
    camera_delay_s: MeasuredNumber | None = setting(
        "Measured delay from the middle of the exposure to the arrival of the image [s]."
    )
    marker_to_cup_m: MeasuredPlace | None = setting(
        "Measured offset of the cup's tie point from the centre of the printed marker [m]."
    )
    body_to_cup_m: MeasuredPlace | None = setting(
        "Measured offset of the cup's tie point from the origin of the tracked body [m]."
    )
    cameras: tuple[PlacedCamera, ...] | None = setting("Calibrated cameras with their poses in the robot's world.")
