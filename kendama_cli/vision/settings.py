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
    colour: str | None = setting(
        "File of a learned colour (JSON), which replaces the thresholds; null uses the thresholds.", file=True
    )
    hue_low: int = setting(
        "Minimum hue. If it is above hue_high, the range runs through red (179 -> 0).", at_least=0, at_most=179
    )
    hue_high: int = setting("Maximum hue.", at_least=0, at_most=179)
    saturation_min: int = setting("Minimum saturation. A larger value excludes paler colours.", at_least=0, at_most=255)
    value_min: int = setting(
        "Minimum brightness (value). A larger value excludes darker pixels.", at_least=0, at_most=255
    )
    min_radius_px: float = setting("Minimum radius of a ball in the image [px].", at_least=1.5)
    min_outline: float = setting(
        "Minimum fraction of the outline that must fit one circle. Below it, no ball is detected.", above=0, at_most=1
    )
    sigma_floor_px: float = setting(
        "Minimum standard deviation that a detected centre is assumed to have [px].", above=0
    )


@dataclass(frozen=True)
class OnsetSettings:
    """The sequential test for free flight on the rope's tension."""

    min_tension_m_s2: float = setting(
        "A taut rope accelerates the ball by at least this along the rope [m/s^2].", above=0
    )
    threshold: float = setting(
        "Log likelihood ratio at which free flight is declared. A larger value is later and safer.", above=0
    )
    min_frames: int = setting("Minimum length of the window that is tested [frames].", at_least=4)
    max_frames: int = setting("Maximum length of the window that is tested [frames].", at_least=4, at_most=120)
    skipped_frames: int = setting(
        "The fit of the flight leaves out this many frames at the start of the window [frames].", at_least=0
    )

    def __post_init__(self) -> None:
        if self.max_frames < self.min_frames:
            raise ConfigError("max_frames", f"'max_frames' is {self.max_frames}; allowed: min_frames or more")


@dataclass(frozen=True)
class BallisticMotion:
    """Gravity and drag alone: for a round, quiet ball."""

    kind: Literal["ballistic"]


@dataclass(frozen=True)
class ColouredMotion:
    """A smooth wobble of the observed point about the flight, as of a ball that does not spin about its centre."""

    kind: Literal["coloured"]
    noise_scale: float = setting(
        "Noise of a measurement as a multiple of the standard deviation that its detector states.", above=0
    )
    sigma_m: float = setting(
        "Standard deviation of the ball's wobble about its flight path, along each axis [m].", above=0
    )
    length_s: float = setting("Correlation time of the wobble [s].", above=0)
    intensity_m2_s3: float = setting(
        "Spectral density of additional white noise on the acceleration [m^2/s^3].", at_least=0
    )


MotionSettings = BallisticMotion | ColouredMotion


@dataclass(frozen=True)
class GravitySettings:
    """Gravity as the calibrated cameras see it; `kendama log predict` estimates its values from recorded flights."""

    scale: float = setting(
        "Gravity that the cameras see, as a multiple of game.gravity_m_s2. It is not 1 if the calibration's scale is "
        "wrong.",
        above=0.8,
        below=1.2,
    )
    tilt_rad: tuple[float, float] = setting(
        "Tilt towards +x and +y of the gravity that the cameras see [rad].", above=-0.3, below=0.3
    )


@dataclass(frozen=True)
class ReleaseSettings:
    """The random flights of the study: a ball on a rope whose cup suddenly yields."""

    apex_low_m: float = setting("Minimum height of the ball's apex above the rim plane [m].", above=0)
    apex_high_m: float = setting("Maximum height of the ball's apex above the rim plane [m].", above=0)
    lateral_m_s: float = setting("Maximum speed of the ball out of the swing plane [m/s].", at_least=0)
    cup_travel_m: float = setting("The cup releases the ball within this distance of x = 0 [m].", at_least=0)
    taut_frames: int = setting("Number of frames with a taut rope before the release [frames].", at_least=0)

    def __post_init__(self) -> None:
        if self.apex_high_m <= self.apex_low_m:
            raise ConfigError("apex_high_m", f"'apex_high_m' is {self.apex_high_m}; allowed: above apex_low_m")


@dataclass(frozen=True)
class PredictSettings:
    """The study of predictions: random flights, cameras, and the fractions of a flight at which errors are taken."""

    flights: int = setting("Number of random flights.", at_least=1)
    observed_fractions: tuple[float, ...] = setting(
        "The prediction error is evaluated after each of these fractions of a flight.", above=0, below=1
    )
    stated_fraction: float = setting(
        "Fraction of a flight at which the metrics give the error; it is one of observed_fractions.", above=0, below=1
    )
    onset_from: Literal["images", "truth"] = setting(
        "Start of the flight: 'images' finds it by the sequential test, 'truth' takes it from the simulation."
    )
    image_every: int = setting("One image in this many of the first flight is logged; 0 logs none.", at_least=0)
    jpeg_quality: int = setting("JPEG quality of the logged images.", at_least=1, at_most=100)
    release: ReleaseSettings = setting("Random flights of the study.")
    gravity: GravitySettings = setting("Gravity as the calibrated cameras see it.")
    motion: MotionSettings = setting("Model of the ball's deviation from gravity and drag.")
    detector: DetectorSettings = setting("Detector of the ball.")
    onset: OnsetSettings = setting("Test for free flight.")

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
