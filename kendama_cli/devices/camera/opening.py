"""Opening all cameras of a configuration, and looking at the ball with them."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

from numpy.typing import ArrayLike

from kendama_cli.artifacts.catch_pose import CatchPose
from kendama_cli.devices.camera.calibration import camera_models
from kendama_cli.devices.camera.interface import Camera, Frame, SceneSource
from kendama_cli.settings.camera import CAMERAS, CameraSettings
from kendama_cli.vision.interface import Sighting
from kendama_cli.vision.tracker import BallTracker


def open_cameras(settings: CameraSettings, clock: Callable[[], float], scene: SceneSource | None) -> list[Camera]:
    """All cameras, calibrated, on one ``clock`` [s]; only rendered ones need a ``scene``.

    Raises ConfigError where the settings contradict each other, InputError where a file cannot be used, and
    MissingPartError where a device is not there.
    """
    return list(CAMERAS.maker(settings.kind)(settings, camera_models(settings), clock, scene))


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
