"""Interface of every camera, rendered, recorded or live."""

from __future__ import annotations

from collections.abc import Callable, Sequence, Sized
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from kendama_cli.devices.camera.calibration import camera_models
from kendama_cli.errors import ConfigError, HardwareError
from kendama_cli.rendering.mesh import LinkMesh
from kendama_cli.rendering.scene import Scene
from kendama_cli.settings.camera import CAMERAS, CameraSettings, LightingSettings
from kendama_cli.settings.game import GameSettings
from kendama_cli.vision.cameras.camera_model import CameraModel, PlaceCamera
from kendama_cli.vision.cameras.region import Region, whole


class StaleFrame(HardwareError):  # noqa: N818 - the name that callers know from the interface
    """No frame is young enough; ``camera`` names it, ``age_s`` is its frame's age (inf: nothing came at all)."""

    def __init__(self, camera: str, age_s: float, message: str) -> None:
        super().__init__(message)
        self.camera = camera
        self.age_s = age_s


@dataclass(frozen=True)
class Frame:
    """One image, or the region of interest of it.

    ``t_s`` is mid-exposure; ``pixels`` (h, w, 3) uint8 in OpenCV's order blue, green, red; ``origin_px`` is the
    column and row of ``pixels[0, 0]`` in the whole image. With a rolling shutter ``t_s`` is the middle row's of the
    whole image, and the camera's model knows the others (``CameraModel.exposed_s``).
    """

    t_s: float
    pixels: NDArray[np.uint8]
    origin_px: tuple[int, int]


class Camera(Protocol):
    """A calibrated camera that always holds its newest frame."""

    model: CameraModel

    @property
    def next_s(self) -> float | None:
        """Return the time of the next frame, on the camera's clock; None if none comes, or unknown (live cameras)."""

    def latest(self, *, max_age_s: float) -> Frame:
        """Return the newest frame; raises StaleFrame if it is older than ``max_age_s``, or if there is none."""

    def set_region_of_interest(self, region: Region | None) -> None:
        """Ask for ``region`` alone from the next frame on (None: the whole image); a frame may still show more."""

    def restart(self) -> None:
        """Forget the newest frame where the clock was set back (a simulated scene begins anew); live cameras go on."""

    def close(self) -> None:
        """Close the device or file; idempotent."""


@dataclass(frozen=True)
class SceneSource:
    """Source of rendered images: the scene, its light, a noise stream per camera, and the meshes of its links.

    ``placed`` gives the true pose of a camera on a link; None where there is no arm.
    """

    scene: Scene
    game: GameSettings
    lighting: LightingSettings
    rngs: Sequence[np.random.Generator]
    links: Sequence[LinkMesh] = ()
    placed: PlaceCamera | None = None


class OpenCameras(Protocol):
    """Function that a variant's ``makes`` names."""

    def __call__(
        self,
        settings: CameraSettings,
        models: Sequence[CameraModel],
        clock: Callable[[], float],
        scene: SceneSource | None,
    ) -> Sequence[Camera]:
        """Open one camera per model, in order, with frames stamped by ``clock`` [s]; ``scene`` is for rendered ones.

        Raises ConfigError, InputError or MissingPartError, and then holds nothing open.
        """


class RegionOfInterest:
    """Cuts from whole images the part that a camera is asked for."""

    def __init__(self, model: CameraModel) -> None:
        self._image = whole(model.width_px, model.height_px)
        self._region = self._image

    def set(self, region: Region | None) -> None:
        """Set ``region``, as far as it lies in the image (None, or nothing of it: the whole image)."""
        part = self._image if region is None else region.within(self._image)
        self._region = self._image if part.empty else part

    def frame(self, t_s: float, pixels: NDArray[np.uint8]) -> Frame:
        """Cut the region of interest from the whole image ``pixels`` (h, w, 3)."""
        r = self._region
        return Frame(t_s, pixels[r.top : r.bottom, r.left : r.right], (r.left, r.top))


def too_old(camera: str, age_s: float, max_age_s: float) -> StaleFrame:
    """Return the error for a newest frame of ``age_s`` if ``max_age_s`` is allowed."""
    return StaleFrame(
        camera,
        age_s,
        f"camera '{camera}': the newest frame is {age_s * 1e3:.0f} ms old, allowed are {max_age_s * 1e3:.0f} ms; "
        "check that the camera still delivers, or lower its rate",
    )


def require_one_each(key: str, given: Sized, what: str, cameras: int) -> None:
    """Raise ConfigError where ``given``, the value of ``key``, does not have one entry for each of the cameras."""
    if len(given) != cameras:
        raise ConfigError(
            key, f"'{key}' has {len(given)} entries for {cameras} cameras: give {what} per camera, as in {key}=[a,b]"
        )


def open_cameras(settings: CameraSettings, clock: Callable[[], float], scene: SceneSource | None) -> list[Camera]:
    """Open all cameras, calibrated, on one ``clock`` [s]; only rendered ones need a ``scene``.

    Without a ``scene`` the images alone count; with one, cameras on a link need it to have an arm.
    Raises ConfigError where the settings contradict each other, InputError where a file cannot be used, and
    MissingPartError where a device is not there.
    """
    models = camera_models(settings, carried=scene is None or scene.placed is not None)
    return list(CAMERAS.maker(settings.kind)(settings, models, clock, scene))
