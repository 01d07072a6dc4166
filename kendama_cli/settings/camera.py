"""Cameras: their calibration, where their images come from, and the light on the scene."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar, Literal, Protocol

from kendama_cli.errors import ConfigError
from kendama_cli.schema.registry import Registry
from kendama_cli.schema.settings import setting

Triple = tuple[float, float, float]
Source = Literal["rendered", "recorded", "live"]
LensKind = Literal["radial"]
CAMERAS = Registry("kendama.cameras", "camera")


@dataclass(frozen=True)
class CameraModelSettings:
    """One camera's calibration, in OpenCV's convention (x right, y down, z forward)."""

    name: str = setting("name, as in the log's topics")
    width_px: int = setting("image width [px]", at_least=16)
    height_px: int = setting("image height [px]", at_least=16)
    focal_px: tuple[float, float] = setting("fx, fy [px]", above=0)
    center_px: tuple[float, float] = setting("principal point cx, cy [px]")
    lens: LensKind = setting(
        "lens model: radial, a pinhole with OpenCV's distortion",
        absent="radial",
    )
    distortion: tuple[float, float, float, float, float] = setting("OpenCV's k1, k2, p1, p2, k3")
    position_m: Triple = setting("optical centre in the world [m]")
    look_at_m: Triple | None = setting(
        "point that a level camera looks at [m]; null where rotation_wxyz gives the pose"
    )
    rotation_wxyz: tuple[float, float, float, float] | None = setting(
        "camera axes in the world, unit quaternion, or null"
    )
    readout_s: float = setting(
        "time from the first line's exposure to the last's [s]: 0 of a global shutter, negative if the lowest line is "
        "first; virtual cameras use their sensor's",
        at_least=-0.1,
        at_most=0.1,
        absent=0.0,
    )

    def __post_init__(self) -> None:
        if (self.look_at_m is None) == (self.rotation_wxyz is None):
            raise ConfigError(
                "look_at_m", "'look_at_m' or 'rotation_wxyz' must give the camera's pose: give one of them"
            )


@dataclass(frozen=True)
class FrameTiming:
    """Exposure times of cameras whose clock is set, not read: frame k of camera i at k/rate_hz + i stagger_s."""

    rate_hz: float
    exposure_s: float
    """Exposure of one row [s]."""
    busy_s: float
    """From the first row's opening to the last row's closing [s]."""
    stagger_s: float = 0.0


@dataclass(frozen=True)
class CameraRig:
    """Settings that every kind of camera has: the calibration of each camera."""

    source: ClassVar[Source]
    live: ClassVar[bool] = False
    """A stage that takes images of what happens only once records; follows from ``source``."""

    def __init_subclass__(cls) -> None:
        cls.live = cls.source == "live"

    calibration: str | None = setting(
        "file of 'kendama camera calibrate' that replaces the values of 'cameras' by name, or null", file=True
    )
    cameras: tuple[CameraModelSettings, ...] = setting("calibration of every camera")

    @property
    def timing(self) -> FrameTiming | None:
        """Return when frames are exposed; rendered cameras know it, others give None."""
        return None


@dataclass(frozen=True)
class SensorSettings:
    """Conversion of light to numbers."""

    shutter: Literal["global", "rolling"] = setting("global exposes all rows at once, rolling one after the other")
    readout_s: float = setting(
        "time from the first row's exposure to the last's with a rolling shutter [s]", at_least=0
    )
    exposure_s: float = setting("exposure time of a row [s]", above=0, at_most=0.1)
    gain: float = setting("part of the full well that a white surface under irradiance 1 fills", above=0)
    full_well_e: float = setting("electrons at full scale; shot noise follows", above=0)
    read_noise_e: float = setting("read noise rms [electrons]", at_least=0)
    gamma: float = setting("encoding exponent: value = light^(1/gamma)", at_least=1, at_most=3)
    focus_sigma_px: float = setting(
        "standard deviation of the blur that a lens out of focus adds [px]", at_least=0, at_most=5
    )
    gain_drift: float = setting(
        "amplitude over the mean of the gain's slow drift, as of automatic exposure", at_least=0, at_most=0.9
    )
    gain_drift_hz: float = setting("frequency of that drift [Hz]", at_least=0, at_most=10)
    encoding: Literal["raw", "yuv420", "jpeg"] = setting(
        "pixel format that the camera sends; yuv420 and jpeg halve the colours' resolution"
    )
    jpeg_quality: int = setting("quality of encoding=jpeg", at_least=10, at_most=100)

    @property
    def rows_s(self) -> float:
        """Time from the first row's exposure to the last's [s]."""
        return self.readout_s if self.shutter == "rolling" else 0.0

    @property
    def busy_s(self) -> float:
        """Time from the first row's opening to the last row's closing [s]."""
        return self.exposure_s + self.rows_s


@dataclass(frozen=True)
class AppearanceSettings:
    """Colours that the virtual camera paints; reflectances are linear red, green, blue in 0..1."""

    ball_rgb: Triple = setting("reflectance of the ball", at_least=0, at_most=1)
    ball_pattern: Literal["plain", "two_tone", "striped", "wooden"] = setting(
        "paint of the ball: one colour, two halves, a band about its centre, or rings like grain"
    )
    ball_second_rgb: Triple = setting("reflectance of the ball's other colour", at_least=0, at_most=1)
    ball_spin_hz: float = setting("rotations per second of a patterned ball", at_least=0, at_most=20)
    cup_rgb: Triple = setting("reflectance of the cup", at_least=0, at_most=1)
    arm_rgb: Triple = setting("reflectance of the arm", at_least=0, at_most=1)
    rope_rgb: Triple = setting("reflectance of the rope", at_least=0, at_most=1)
    wall_rgb: Triple = setting("reflectance of the wall behind the scene", at_least=0, at_most=1)
    wall_image: str | None = setting("image on the wall instead, 3 m wide about x = 0, z = 0, or null", file=True)
    table_rgb: Triple = setting("reflectance of the table", at_least=0, at_most=1)
    rope_radius_m: float = setting("radius of the rope [m]", above=0)
    arm_radius_m: float = setting("radius of the arm's links [m]", above=0)
    wall_y_m: float = setting("y of the wall's plane [m]")
    table_z_m: float = setting("z of the table's plane [m]")


@dataclass(frozen=True)
class VirtualCamera(CameraRig):
    """Ray-cast images of the scene's poses."""

    source: ClassVar[Source] = "rendered"

    kind: Literal["virtual"] = setting("rendered images")
    rate_hz: float = setting("frames per second of every camera", above=0, at_most=1000)
    stagger_s: float = setting("each camera exposes this much after the one before [s]", at_least=0)
    sensor: SensorSettings = setting("the sensor, the same in every camera")
    appearance: AppearanceSettings = setting("colours of the scene")

    @property
    def timing(self) -> FrameTiming:
        """All cameras have one rate and one kind of sensor."""
        return FrameTiming(self.rate_hz, self.sensor.exposure_s, self.sensor.busy_s, self.stagger_s)

    def __post_init__(self) -> None:
        busy_s = self.sensor.busy_s
        if busy_s > 1 / self.rate_hz + 1e-12:
            raise ConfigError(
                "sensor",
                f"'sensor' takes {busy_s:.4g} s per frame (exposure and readout), but 'rate_hz' {self.rate_hz:g} "
                f"leaves {1 / self.rate_hz:.4g} s; shorten exposure_s or readout_s, or lower rate_hz",
            )


@dataclass(frozen=True)
class FileCamera(CameraRig):
    """Recorded images: a video, or a folder of images with times.csv, per camera."""

    source: ClassVar[Source] = "recorded"

    kind: Literal["file"] = setting("recorded images")
    paths: tuple[str, ...] = setting(
        "one video file, or times.csv of an image folder, per camera", file=True, lists_images=True
    )
    rate_hz: float | None = setting(
        "frames per second, where a video does not say [Hz]; null believes the file", above=0
    )


@dataclass(frozen=True)
class DeviceCamera(CameraRig):
    """Live cameras through OpenCV."""

    source: ClassVar[Source] = "live"

    kind: Literal["device"] = setting("live images")
    indices: tuple[int, ...] = setting("OpenCV device index of every camera", at_least=0)
    rate_hz: float = setting("frames per second to ask for [Hz]", above=0)
    latency_s: float = setting("delay from mid-exposure to the image's arrival [s]", at_least=0)


class CameraSettingsNode(Protocol):
    """Settings of every kind of camera beside fields of its own: derive them from CameraRig."""

    source: ClassVar[Source]
    """``rendered`` from a simulated scene, ``recorded``, or ``live``: what a stage can ask of it"""

    @property
    def kind(self) -> str:
        """The name under which the camera is registered."""

    @property
    def rate_hz(self) -> float | None:
        """Frames per second of every camera; None only where the recording knows it."""

    @property
    def timing(self) -> FrameTiming | None:
        """Return when frames are exposed, of cameras whose ``source`` is ``rendered``; see CameraRig."""

    @property
    def calibration(self) -> str | None:
        """See CameraRig."""

    @property
    def cameras(self) -> tuple[CameraModelSettings, ...]:
        """See CameraRig."""


CameraSettings = Annotated[CameraSettingsNode, CAMERAS]
"""The node ``camera``: settings of any registered camera."""


@dataclass(frozen=True)
class LightSettings:
    """One lamp; it throws shadows."""

    position_m: Triple = setting("position of the lamp [m]")
    irradiance: float = setting("brightness of a surface that faces it; 1 with gain 1 fills the sensor", at_least=0)


@dataclass(frozen=True)
class LightingSettings:
    """The light on a virtual scene."""

    ambient: float = setting("irradiance from everywhere", at_least=0)
    lamps: tuple[LightSettings, ...] = setting("lamps")
    wall_glow: float = setting("light that the wall itself sends: a window or screen behind the scene", at_least=0)
    flicker_hz: float = setting("frequency of the lamps' flicker [Hz]", at_least=0)
    flicker_depth: float = setting("flicker's amplitude over the mean: 0 steady, 1 full", at_least=0, at_most=1)
