"""Opening all cameras of a configuration, and looking at the ball with them."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from kendama_cli.artifacts.catch_pose import CatchPose
from kendama_cli.devices.camera.calibration import camera_models
from kendama_cli.devices.camera.device import DeviceCameraBlock
from kendama_cli.devices.camera.file import FileCameraBlock
from kendama_cli.devices.camera.interface import Camera, Frame
from kendama_cli.devices.camera.virtual import VirtualCameraBlock
from kendama_cli.errors import ConfigError
from kendama_cli.rendering.mesh import LinkMesh
from kendama_cli.rendering.scene import Scene
from kendama_cli.settings.camera import CameraSettings, DeviceCamera, FileCamera, LightingSettings
from kendama_cli.settings.game import GameSettings
from kendama_cli.vision.detector import Sighting
from kendama_cli.vision.tracker import BallTracker


@dataclass(frozen=True)
class SceneSource:
    """What virtual cameras look at: the scene, its light, a noise stream per camera, and the meshes of its links."""

    scene: Scene
    game: GameSettings
    lighting: LightingSettings
    rngs: Sequence[np.random.Generator]
    links: Sequence[LinkMesh] = ()


def open_cameras(settings: CameraSettings, clock: Callable[[], float], world: SceneSource | None) -> list[Camera]:
    """All cameras, calibrated, on one ``clock`` [s]; only virtual ones need a ``world``.

    Raises ConfigError where the settings contradict each other, InputError where a file cannot be used, and
    MissingPartError where a device is not there.
    """
    models = camera_models(settings)
    if isinstance(settings, FileCamera):
        _same_number("camera.paths", len(settings.paths), "a video, or the times.csv of an image folder", len(models))
        return [
            FileCameraBlock(model, path, clock=clock, rate_hz=settings.rate_hz)
            for model, path in zip(models, settings.paths, strict=True)
        ]
    if isinstance(settings, DeviceCamera):
        _same_number("camera.indices", len(settings.indices), "an OpenCV device index", len(models))
        opened: list[Camera] = []
        try:
            for model, index in zip(models, settings.indices, strict=True):
                opened.append(DeviceCameraBlock(model, index, settings, clock=clock))
        except BaseException:
            for camera in opened:
                camera.close()
            raise
        return opened
    if world is None:
        raise ConfigError("camera.kind", "'camera.kind' is 'virtual', which shows a simulated scene only")
    return [
        VirtualCameraBlock(
            model,
            settings,
            world.game,
            world.lighting,
            scene=world.scene,
            clock=clock,
            rng=rng,
            offset_s=number * settings.stagger_s,
            links=world.links,
        )
        for number, (model, rng) in enumerate(zip(models, world.rngs, strict=True))
    ]


def _same_number(key: str, given: int, what: str, wanted: int) -> None:
    if given != wanted:
        raise ConfigError(
            key, f"'{key}' has {given} entries for {wanted} cameras: give {what} per camera, as in {key}=[a,b]"
        )


@dataclass(frozen=True)
class Look:
    """One moment: each camera's frame and sighting, and the catching pose as known after it."""

    t_s: float
    frames: Mapping[str, Frame]
    sightings: Mapping[str, Sighting | None]
    pose: CatchPose | None


def look(
    cameras: Sequence[Camera],
    tracker: BallTracker,
    t_s: float,
    tie_m: ArrayLike,
    *,
    max_age_s: float,
    whole: bool = False,
) -> Look:
    """Take the newest frame of every camera about ``t_s`` and follow the ball in it.

    Each camera watches the tracker's region only, unless ``whole`` images are wanted; a StaleFrame passes through.
    """
    frames: dict[str, Frame] = {}
    sightings: dict[str, Sighting | None] = {}
    for camera in cameras:
        name = camera.model.name
        camera.watch(None if whole else tracker.region(name, t_s))
        frame = camera.latest(max_age_s=max_age_s)
        frames[name] = frame
        sightings[name] = tracker.look(name, frame.t_s, frame.pixels, frame.origin_px)
    pose = None
    for moment in sorted({frame.t_s for frame in frames.values()}):
        together = {name: sightings[name] for name, frame in frames.items() if frame.t_s == moment}
        pose = tracker.update(moment, together, tie_m)
    return Look(max(frame.t_s for frame in frames.values()), frames, sightings, pose)
