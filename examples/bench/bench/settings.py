"""Settings of all parts of the bench."""

from dataclasses import dataclass
from typing import ClassVar, Literal

from kendama_cli.extension import CameraRig, setting


@dataclass(frozen=True)
class DemonstratorSettings:
    kind: Literal["bench"]
    swings: int = setting("Number of demonstrations.", at_least=1)
    rate_hz: float = setting("Samples per second [Hz].", above=0)


@dataclass(frozen=True)
class CameraSettings(CameraRig):
    source: ClassVar = "live"  # or "recorded", or "rendered" from a simulated scene
    kind: Literal["bench"] = setting("The images come from the bench's camera.")
    rate_hz: float = setting("Images per second [Hz].", above=0)


@dataclass(frozen=True)
class RobotSettings:
    moves: ClassVar[bool] = False  # True if a real arm may move: then --arm is required and no result is cached
    kind: Literal["bench"]
    compliance_rad_nm: float = setting("Rotation of a joint under a torque of 1 Nm [rad/Nm].", above=0)


@dataclass(frozen=True)
class DetectorSettings:
    kind: Literal["bench"]
    min_redness: int = setting("Minimum by which the ball's red exceeds its green and blue.", at_least=1, at_most=255)


@dataclass(frozen=True)
class LearnerSettings:
    kind: Literal["bench"]
    spread: tuple[float, float, float, float] = setting(
        "Standard deviations of the gains on x [1/s^2], velocity [1/s], angle [m/s^2/rad] and rate [m/s/rad].", above=0
    )
    resample_probability: float = setting(
        "Probability of sampling a new law after the stored one failed.", above=0, at_most=1
    )
