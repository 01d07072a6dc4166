"""The virtual camera: ray-cast images of a scene's poses, with a sensor's exposure and noise."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import cached_property, partial

import numpy as np

from kendama_cli.devices.camera.interface import Frame, SceneSource, StaleFrame, too_old
from kendama_cli.errors import ConfigError
from kendama_cli.rendering.carried import held_still, window_light
from kendama_cli.rendering.mesh import LinkMesh
from kendama_cli.rendering.moving import SceneSampler, Shot
from kendama_cli.rendering.raycast import Raycaster
from kendama_cli.rendering.scene import Scene
from kendama_cli.rendering.sensor import Sensor
from kendama_cli.schema.arrays import Array
from kendama_cli.settings.camera import LightingSettings, VirtualCamera
from kendama_cli.settings.game import GameSettings
from kendama_cli.vision.cameras.camera_model import CameraModel, PlaceCamera
from kendama_cli.vision.cameras.region import Region, whole

FRAME_STEP = 0xD1342543DE82EF95
"""Odd, so that the keys of noise of a camera's frames all differ."""


LightAt = Callable[[float], Callable[[Region], Array]]
"""Renderer: returns for a time the function that gives the light (h, w, 3) in a region."""


def open_virtual(
    settings: VirtualCamera,
    models: Sequence[CameraModel],
    clock: Callable[[], float],
    scene: SceneSource | None,
    light: Callable[[CameraModel], LightAt] | None = None,
) -> list[VirtualCameraBlock]:
    """Open rendered cameras, see OpenCameras; ``light`` renders in the place of the ray caster.

    Raises ConfigError without a ``scene``.
    """
    if scene is None:
        raise ConfigError("camera.kind", f"'camera.kind' is '{settings.kind}', which shows a simulated scene only")
    return [
        VirtualCameraBlock(
            model,
            settings,
            scene.game,
            scene.lighting,
            scene=scene.scene,
            clock=clock,
            rng=rng,
            offset_s=number * settings.stagger_s,
            links=scene.links,
            placed=scene.placed,
            light=None if light is None else light(model),
        )
        for number, (model, rng) in enumerate(zip(models, scene.rngs, strict=True))
    ]


class VirtualCameraBlock:
    """A camera that exposes every 1/rate seconds of ``clock`` from time zero on (plus ``offset_s``).

    It knows the scene's poses and the sizes of ball and cup, and nothing of how they move. ``light`` renders in the
    place of the ray caster.
    """

    def __init__(
        self,
        model: CameraModel,
        settings: VirtualCamera,
        game: GameSettings,
        lighting: LightingSettings,
        *,
        scene: Scene,
        clock: Callable[[], float],
        rng: np.random.Generator,
        offset_s: float = 0.0,
        links: Sequence[LinkMesh] = (),
        placed: PlaceCamera | None = None,
        light: LightAt | None = None,
    ) -> None:
        sensor = settings.sensor
        self.model = replace(model, readout_s=sensor.rows_s)
        self._settings, self._lighting = settings, lighting
        self._sampler = SceneSampler(settings.appearance, links)
        self._raycaster = partial(Raycaster, appearance=settings.appearance, lighting=lighting, game=game)
        self._placed = placed if model.link is not None else None
        self._light_at = light or self._light
        self._busy_s = sensor.busy_s
        self._sensor = Sensor(sensor)
        self._offset_s = offset_s
        self._region: Region | None = None
        self._scene, self._clock, self._rng = scene, clock, rng
        if light is None:
            _ = self._still  # a picture for the wall that cannot be read is told here, not at the first frame
        self.restart()

    def restart(self) -> None:
        self._index: int | None = None
        self._frame: Frame | None = None
        self._key: int | None = None

    def set_region_of_interest(self, region: Region | None) -> None:
        self._region = region

    @property
    def next_s(self) -> float:
        """Return the time at which the present exposure ends."""
        index = self._newest_index() + 1
        return max(index, 0) / self._settings.rate_hz + self._offset_s + self._busy_s / 2

    def _newest_index(self) -> int:
        period = 1 / self._settings.rate_hz
        return math.floor((self._clock() - self._busy_s / 2 - self._offset_s) / period + 1e-9)

    def latest(self, *, max_age_s: float) -> Frame:
        period = 1 / self._settings.rate_hz
        now = self._clock()
        index = self._newest_index()
        if index < 0:
            raise StaleFrame(self.model.name, math.inf, f"camera '{self.model.name}': no frame yet at {now:.3f} s")
        t_s = index * period + self._offset_s
        if now - t_s > max_age_s:
            raise too_old(self.model.name, now - t_s, max_age_s)
        if self._frame is None or index != self._index:
            self._index, self._frame = index, self._expose(t_s, index)
        return self._frame

    def close(self) -> None:
        """Do nothing: nothing is held."""

    def _expose(self, t_s: float, number: int) -> Frame:
        image = whole(self.model.width_px, self.model.height_px)
        region = image if self._region is None else self._region.within(image)
        if region.empty:
            region = Region(0, 0, 1, 1)
        if self._key is None:  # sampled late, so that a stream restored after opening is the one that counts
            self._key = int(self._rng.integers(2**63))
        key = np.uint64((self._key + number * FRAME_STEP) % 2**64)
        pixels = self._sensor.image(self._light_at(t_s), region, image, t_s=t_s, key=key)
        return Frame(t_s, pixels, (region.left, region.top))

    @cached_property
    def _still(self) -> Raycaster:
        return self._raycaster(self.model)

    def _light(self, t_s: float) -> Callable[[Region], Array]:
        """Return the function that renders the light (h, w, 3) in a region of the frame of ``t_s``."""
        if self._placed is None:
            return partial(self._still.render, self._shot(self._scene, t_s))
        model, scene = held_still(self._scene, self._placed, self.model, t_s)
        return partial(window_light, self._raycaster, model, self._shot(scene, t_s))

    def _shot(self, scene: Scene, t_s: float) -> Shot:
        """Return the scene from the first row's opening to the last row's closing about ``t_s``."""
        exposure_s, half = self._settings.sensor.exposure_s, self._busy_s / 2
        moving = self._sampler.moving(scene, t_s - half, t_s + half)
        moments = len(moving.ball_m) - 1
        rows = np.arange(self.model.height_px, dtype=np.float64) - (self.model.height_px - 1) / 2
        row_tau = (0.5 + rows * self.model.row_s / self._busy_s) * moments
        strength = _flicker(self._lighting, t_s + rows * self.model.row_s, exposure_s)
        return Shot(t_s, moving, row_tau, exposure_s / self._busy_s * moments, strength)


def _flicker(lighting: LightingSettings, t_s: Array, exposure_s: float) -> Array:
    """Return the lamps' mean strength over exposures about ``t_s`` (h,): 1 + depth sin(2 pi f t) averaged."""
    f = lighting.flicker_hz
    mean = np.sinc(f * exposure_s) * np.sin(2 * np.pi * f * t_s)
    return np.asarray(1.0 + lighting.flicker_depth * mean)
