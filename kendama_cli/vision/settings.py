"""Settings of detection and prediction: the detector, the onset of free flight, the study of both."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Literal

from kendama_cli.errors import ConfigError
from kendama_cli.schema.registry import ChosenSettings, Registry
from kendama_cli.schema.settings import setting

DETECTORS = Registry("kendama.detectors", "detector")


DetectorSettings = Annotated[ChosenSettings, DETECTORS]
"""The node ``predict.detector``: settings of any registered detector."""


@dataclass(frozen=True)
class ColourDetectorSettings:
    """A ball of one colour; hue, saturation and value on OpenCV's scales (0..179, 0..255, 0..255)."""

    kind: Literal["colour"]
    colour: str | None = setting("file of a learned colour (JSON); null: the thresholds below", file=True)
    hue_low: int = setting("lowest hue; above hue_high the range runs through red (179 -> 0)", at_least=0, at_most=179)
    hue_high: int = setting("highest hue", at_least=0, at_most=179)
    saturation_min: int = setting("least saturation", at_least=0, at_most=255)
    value_min: int = setting("least value", at_least=0, at_most=255)
    min_radius_px: float = setting("smallest ball [px]", at_least=1.5)
    min_outline: float = setting("part of the outline that must fit one circle, else 'not seen'", above=0, at_most=1)
    sigma_floor_px: float = setting("least standard deviation that a centre is credited with [px]", above=0)


@dataclass(frozen=True)
class OnsetSettings:
    """The sequential test for free flight on the rope's tension."""

    min_tension_m_s2: float = setting("least acceleration along a taut rope [m/s^2]", above=0)
    threshold: float = setting("log likelihood ratio that declares free flight", above=0)
    min_frames: int = setting("shortest window [frames]", at_least=4)
    max_frames: int = setting("longest window [frames]", at_least=4, at_most=120)
    skipped_frames: int = setting("first frames of the declared window that the fit leaves out", at_least=0)

    def __post_init__(self) -> None:
        if self.max_frames < self.min_frames:
            raise ConfigError("max_frames", f"'max_frames' is {self.max_frames}; allowed: min_frames or more")


@dataclass(frozen=True)
class BallisticMotion:
    """Gravity and drag alone: for a round, quiet ball."""

    kind: Literal["ballistic"]


@dataclass(frozen=True)
class ColouredMotion:
    """A smooth wobble of what is seen about the flight, as of a ball that spins about another point than its centre."""

    kind: Literal["coloured"]
    sigma_m: float = setting("standard deviation of the wobble along each axis [m]", above=0)
    length_s: float = setting("correlation time of the wobble [s]", above=0)
    intensity_m2_s3: float = setting(
        "spectral density of white noise on the acceleration besides [m^2/s^3]", at_least=0
    )


MotionSettings = BallisticMotion | ColouredMotion


@dataclass(frozen=True)
class GravitySettings:
    """Gravity as the calibrated cameras see it; `kendama log predict` estimates the values of one's own flights."""

    scale: float = setting("magnitude over game.gravity_m_s2, for a wrong scale", above=0.8, below=1.2)
    tilt_rad: tuple[float, float] = setting("tilt towards +x and +y [rad]", above=-0.3, below=0.3)


@dataclass(frozen=True)
class ReleaseSettings:
    """The random flights of the study: a ball on a rope whose cup suddenly yields."""

    apex_low_m: float = setting("lowest apex of the ball over the rim plane [m]", above=0)
    apex_high_m: float = setting("highest apex over the rim plane [m]", above=0)
    lateral_m_s: float = setting("largest speed out of the swing plane [m/s]", at_least=0)
    cup_travel_m: float = setting("the cup releases within this distance of x = 0 [m]", at_least=0)
    taut_frames: int = setting("frames before the release [frames]", at_least=0)

    def __post_init__(self) -> None:
        if self.apex_high_m <= self.apex_low_m:
            raise ConfigError("apex_high_m", f"'apex_high_m' is {self.apex_high_m}; allowed: above apex_low_m")


@dataclass(frozen=True)
class PredictSettings:
    """The study: how many flights, what is measured when."""

    flights: int = setting("random flights", at_least=1)
    observed_fractions: tuple[float, ...] = setting(
        "parts of a flight after which the error is taken", above=0, below=1
    )
    stated_fraction: float = setting("the one of them that the metrics state", above=0, below=1)
    onset_from: Literal["images", "truth"] = setting("start of the flight: by the sequential test, or the truth")
    image_every: int = setting("log every so many frames of the first flight as images; 0: none", at_least=0)
    jpeg_quality: int = setting("quality of logged images", at_least=1, at_most=100)
    release: ReleaseSettings = setting("the flights")
    gravity: GravitySettings = setting("the cameras' calibrated gravity")
    motion: MotionSettings = setting("model of the ball's deviation from gravity and drag")
    detector: DetectorSettings = setting("detector of the ball")
    onset: OnsetSettings = setting("test for free flight")

    def __post_init__(self) -> None:
        if list(self.observed_fractions) != sorted(set(self.observed_fractions)):
            raise ConfigError(
                "observed_fractions",
                f"'observed_fractions' is {list(self.observed_fractions)}; allowed: rising numbers below 1",
            )
        if self.stated_fraction not in self.observed_fractions:
            raise ConfigError(
                "stated_fraction",
                f"'stated_fraction' is {self.stated_fraction}; allowed: one of observed_fractions "
                f"{', '.join(map(str, self.observed_fractions))}",
            )
