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
STREAMS = ("http", "https", "rtsp", "rtsps", "tcp", "udp")
"""Schemes of a stream's address; OpenCV would open files and lists of addresses as well."""


@dataclass(frozen=True)
class CameraModelSettings:
    """One camera's calibration, in OpenCV's convention (x right, y down, z forward)."""

    name: str = setting("Name of the camera, as in the log's topics.")
    width_px: int = setting("Width of the image [px].", at_least=16)
    height_px: int = setting("Height of the image [px].", at_least=16)
    focal_px: tuple[float, float] = setting("Focal lengths fx and fy [px].", above=0)
    center_px: tuple[float, float] = setting("Principal point cx, cy [px].")
    lens: LensKind = setting("Lens model; radial is a pinhole with OpenCV's distortion.", absent="radial")
    distortion: tuple[float, float, float, float, float] = setting(
        "Distortion coefficients k1, k2, p1, p2 and k3 of OpenCV."
    )
    link: str | None = setting(
        "Link of the arm that carries the camera, whose pose is then in this link's frame; null in the world.",
        absent=None,
    )
    position_m: Triple = setting("Position of the optical centre in the world, or in the frame of 'link' [m].")
    look_at_m: Triple | None = setting(
        "Point at which a level camera looks, in the same frame [m]; null if rotation_wxyz gives the rotation."
    )
    rotation_wxyz: tuple[float, float, float, float] | None = setting(
        "Unit quaternion of the camera's axes in the same frame, real part first; null if look_at_m gives them."
    )
    readout_s: float = setting(
        "Time from the exposure of the first row to that of the last [s]. It is 0 for a global shutter and negative "
        "if the lowest row is first; virtual cameras use their sensor's.",
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
        "File by 'kendama camera calibrate' whose values replace those of the cameras with the same names, or null.",
        file=True,
    )
    cameras: tuple[CameraModelSettings, ...] = setting("Calibration of every camera.")

    @property
    def timing(self) -> FrameTiming | None:
        """Return when frames are exposed; rendered cameras know it, others give None."""
        return None


@dataclass(frozen=True)
class SensorSettings:
    """Conversion of light to numbers."""

    shutter: Literal["global", "rolling"] = setting(
        "Shutter of the sensor: 'global' exposes all rows at once, 'rolling' one after the other."
    )
    readout_s: float = setting(
        "With a rolling shutter, time from the exposure of the first row to that of the last [s].", at_least=0
    )
    exposure_s: float = setting(
        "Exposure time of each row [s]. Longer exposures are brighter and blur fast motion.", above=0, at_most=0.1
    )
    gain: float = setting("Fraction of the full well that a white surface under irradiance 1 fills.", above=0)
    full_well_e: float = setting("Number of electrons at full scale. Fewer electrons give more shot noise.", above=0)
    read_noise_e: float = setting("Standard deviation of the read noise [electrons].", at_least=0)
    gamma: float = setting("Exponent of the encoding: value = light^(1/gamma).", at_least=1, at_most=3)
    focus_sigma_px: float = setting(
        "Standard deviation of the blur by a lens out of focus [px].", at_least=0, at_most=5
    )
    gain_drift: float = setting(
        "Amplitude of a slow drift of the gain, relative to its mean, as automatic exposure causes it.",
        at_least=0,
        at_most=0.9,
    )
    gain_drift_hz: float = setting("Frequency of the gain's drift [Hz].", at_least=0, at_most=10)
    encoding: Literal["raw", "yuv420", "jpeg"] = setting(
        "Format in which the camera sends its pixels; yuv420 and jpeg halve the resolution of the colours."
    )
    jpeg_quality: int = setting("JPEG quality, used by encoding=jpeg.", at_least=10, at_most=100)

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

    ball_rgb: Triple = setting("Reflectance of the ball (linear red, green, blue).", at_least=0, at_most=1)
    ball_pattern: Literal["plain", "two_tone", "striped", "wooden"] = setting(
        "Paint of the ball: 'plain' is one colour, 'two_tone' two halves, 'striped' a band around its centre, "
        "'wooden' rings like grain."
    )
    ball_second_rgb: Triple = setting(
        "Reflectance of the ball's second colour (linear red, green, blue).", at_least=0, at_most=1
    )
    ball_spin_hz: float = setting(
        "The ball spins this often per second, which shows if it has a pattern [Hz].", at_least=0, at_most=20
    )
    cup_rgb: Triple = setting("Reflectance of the cup (linear red, green, blue).", at_least=0, at_most=1)
    arm_rgb: Triple = setting("Reflectance of the arm (linear red, green, blue).", at_least=0, at_most=1)
    rope_rgb: Triple = setting("Reflectance of the rope (linear red, green, blue).", at_least=0, at_most=1)
    wall_rgb: Triple = setting(
        "Reflectance of the wall behind the scene (linear red, green, blue).", at_least=0, at_most=1
    )
    wall_image: str | None = setting(
        "File of an image that covers the wall, 3 m wide and centred on x = 0, z = 0; null for a plain wall.", file=True
    )
    table_rgb: Triple = setting("Reflectance of the table (linear red, green, blue).", at_least=0, at_most=1)
    rope_radius_m: float = setting("Radius of the rope [m].", above=0)
    arm_radius_m: float = setting("Radius of the arm's links [m].", above=0)
    wall_y_m: float = setting("Position of the wall's plane along y [m].")
    table_z_m: float = setting("Height z of the table's plane [m].")


@dataclass(frozen=True)
class VirtualCamera(CameraRig):
    """Ray-cast images of the scene's poses."""

    source: ClassVar[Source] = "rendered"

    kind: Literal["virtual"] = setting("The cameras render their images.")
    rate_hz: float = setting("Every camera takes this many images per second [Hz].", above=0, at_most=1000)
    stagger_s: float = setting("Each camera exposes this much later than the one before it [s].", at_least=0)
    sensor: SensorSettings = setting("Sensor of every camera.")
    appearance: AppearanceSettings = setting("Colours of the scene.")

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

    kind: Literal["file"] = setting("The images are recorded ones.")
    paths: tuple[str, ...] = setting(
        "One video file per camera, or one times.csv of a folder of images.", file=True, lists_images=True
    )
    rate_hz: float | None = setting(
        "Images per second, if a video does not state it [Hz]; null takes the rate of the file.", above=0
    )


@dataclass(frozen=True)
class DeviceCamera(CameraRig):
    """Live cameras through OpenCV."""

    source: ClassVar[Source] = "live"

    kind: Literal["device"] = setting("The images come from live cameras.")
    indices: tuple[int, ...] = setting("OpenCV device index of every camera.", at_least=0)
    addresses: tuple[str, ...] = setting(
        "Address of every camera's stream, such as rtsp://host/video or http://host/video; empty takes indices. "
        "A run stores it, with a password in it."
    )
    rate_hz: float = setting("Requested images per second [Hz].", above=0)
    latency_s: float = setting("Delay from the middle of the exposure to the arrival of the image [s].", at_least=0)

    def __post_init__(self) -> None:
        for address in self.addresses:
            if address.partition("://")[0] not in STREAMS or "://" not in address:
                raise ConfigError(
                    "addresses", f"'addresses' has '{address}'; an address begins with {', '.join(STREAMS)} and ://"
                )


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
    """A lamp, which casts shadows."""

    position_m: Triple = setting("Position of the lamp in the world [m].")
    irradiance: float = setting(
        "Irradiance of a surface that faces the lamp. With gain 1, an irradiance of 1 saturates white.", at_least=0
    )


@dataclass(frozen=True)
class LightingSettings:
    """Light in a virtual scene."""

    ambient: float = setting("Irradiance that reaches every surface from all directions.", at_least=0)
    lamps: tuple[LightSettings, ...] = setting("Lamps of the scene.")
    wall_glow: float = setting(
        "Light that the wall itself emits, like a window or screen behind the scene.", at_least=0
    )
    flicker_hz: float = setting("Frequency at which the lamps flicker [Hz].", at_least=0)
    flicker_depth: float = setting(
        "Amplitude of the flicker relative to the mean light: 0 is steady, 1 is full.", at_least=0, at_most=1
    )
