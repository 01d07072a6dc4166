"""Settings of all parts of the bench."""

from dataclasses import dataclass
from typing import ClassVar, Literal

from kendama_cli.extension import CameraRig, setting


@dataclass(frozen=True)
class DemonstratorSettings:
    kind: Literal["bench"]
    swings: int = setting("number of demonstrations", at_least=1)
    rate_hz: float = setting("samples per second [Hz]", above=0)


@dataclass(frozen=True)
class CameraSettings(CameraRig):
    source: ClassVar = "live"  # or "recorded", or "rendered" from a simulated scene
    kind: Literal["bench"] = setting("the bench's camera")
    rate_hz: float = setting("frames per second [Hz]", above=0)


@dataclass(frozen=True)
class RobotSettings:
    moves: ClassVar[bool] = False  # True if a real arm may move: then --arm is required and no result is cached
    kind: Literal["bench"]
    compliance_rad_nm: float = setting("rotation of a joint under 1 Nm [rad/Nm]", above=0)


@dataclass(frozen=True)
class DetectorSettings:
    kind: Literal["bench"]
    min_redness: int = setting("least excess of the ball's red over its green and blue", at_least=1, at_most=255)


@dataclass(frozen=True)
class LearnerSettings:
    kind: Literal["bench"]
    spread: tuple[float, float, float, float] = setting(
        "standard deviations of the gains on x [1/s^2], velocity [1/s], angle [m/s^2/rad] and rate [m/s/rad]", above=0
    )
    resample_probability: float = setting(
        "probability of sampling a new law after the stored one failed", above=0, at_most=1
    )
