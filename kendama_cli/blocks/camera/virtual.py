"""The virtual camera: ray-cast images of a scene's poses, with a sensor's exposure and noise."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from kendama_cli.artifacts.checks import Array
from kendama_cli.blocks.camera.interface import Frame, StaleFrame, too_old
from kendama_cli.blocks.camera.raycast import Body, Raycaster, segments
from kendama_cli.blocks.camera.scene import Scene, ScenePose
from kendama_cli.blocks.camera.shapes import OpenCup, Sphere
from kendama_cli.settings.camera import LightingSettings, SensorSettings, VirtualCamera
from kendama_cli.settings.game import GameSettings
from kendama_cli.vision.camera_model import CameraModel
from kendama_cli.vision.region import Region, whole


class VirtualCameraBlock:
    """A camera that exposes every 1/rate seconds of ``clock`` from time zero on (plus ``offset_s``).

    It is told the scene's poses and the sizes of ball and cup, and nothing of how they move.
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
    ) -> None:
        self.model = model
        self._settings = settings
        self._game = game
        self._raycaster = Raycaster(model, settings.appearance, lighting)
        self._offset_s = offset_s
        self._region: Region | None = None
        self._scene, self._clock, self._rng = scene, clock, rng
        self.restart()

    def restart(self) -> None:
        self._index: int | None = None
        self._frame: Frame | None = None

    def watch(self, region: Region | None) -> None:
        self._region = region

    def latest(self, *, max_age_s: float) -> Frame:
        period, half = 1 / self._settings.rate_hz, self._settings.sensor.exposure_s / 2
        now = self._clock()
        index = math.floor((now - half - self._offset_s) / period + 1e-9)
        if index < 0:
            raise StaleFrame(self.model.name, math.inf, f"camera '{self.model.name}': no frame yet at {now:.3f} s")
        t_s = index * period + self._offset_s
        if now - t_s > max_age_s:
            raise too_old(self.model.name, now - t_s, max_age_s)
        if self._frame is None or index != self._index:
            self._index, self._frame = index, self._expose(t_s)
        return self._frame

    def close(self) -> None:
        """Nothing is held."""

    def _expose(self, t_s: float) -> Frame:
        sensor = self._settings.sensor
        image = whole(self.model.width_px, self.model.height_px)
        region = image if self._region is None else self._region.within(image)
        if region.empty:
            region = Region(0, 0, 1, 1)
        half = sensor.exposure_s / 2
        bodies = self._bodies(self._scene(t_s - half), self._scene(t_s + half), sensor.exposure_s)
        light = self._raycaster.render(bodies, region, t_s, sensor.exposure_s)
        return Frame(t_s, _digitise(light, sensor, self._rng), (region.left, region.top))

    def _bodies(self, before: ScenePose, after: ScenePose, exposure_s: float) -> list[Body]:
        look, game = self._settings.appearance, self._game

        def middle(a: Array, b: Array) -> Array:
            return np.asarray((a + b) / 2)

        def speed(a: Array, b: Array) -> Array:
            return np.asarray((b - a) / exposure_s)

        cup = OpenCup(
            middle(before.cup_m, after.cup_m),
            before.cup_rotation,
            game.cup.radius_m,
            game.cup.depth_m,
            game.cup.wall_m,
            look.cup_rgb,
        )
        ball = Sphere(middle(before.ball_m, after.ball_m), game.ball.radius_m, look.ball_rgb)
        rope, arm = middle(before.rope_m, after.rope_m), middle(before.arm_m, after.arm_m)
        return [
            *segments(arm, speed(before.arm_m, after.arm_m), look.arm_radius_m, look.arm_rgb),
            Body(cup, speed(before.cup_m, after.cup_m), shadow=True),
            *segments(rope, speed(before.rope_m, after.rope_m), look.rope_radius_m, look.rope_rgb),
            Body(ball, speed(before.ball_m, after.ball_m), shadow=True),
        ]


def _digitise(light: NDArray[np.float32], sensor: SensorSettings, rng: np.random.Generator) -> NDArray[np.uint8]:
    """Electrons with shot and read noise (both Gaussian), clipped at the full well, gamma-coded to 8 bits, as BGR."""
    electrons = light[..., ::-1] * np.float32(sensor.gain * sensor.full_well_e)
    noise = rng.standard_normal(electrons.shape, dtype=np.float32)
    electrons = electrons + noise * np.sqrt(electrons + np.float32(sensor.read_noise_e**2))
    level = np.clip(electrons / np.float32(sensor.full_well_e), 0, 1) ** np.float32(1 / sensor.gamma)
    return np.asarray(np.rint(level * 255), dtype=np.uint8)
