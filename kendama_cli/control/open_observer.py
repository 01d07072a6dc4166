"""Opening of the observer of games: virtual or live cameras, or the robot's own tracking."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial

import numpy as np

from kendama_cli.control.camera_observer import CameraClock, CameraObserver
from kendama_cli.control.catch_controller import CatchGeometry
from kendama_cli.control.flight_observer import (
    FlightObserver,
    MarkerObserver,
)
from kendama_cli.control.position_tracker import PositionTracker
from kendama_cli.control.scene_history import SceneHistory
from kendama_cli.control.settings import ObservationSettings
from kendama_cli.devices.camera.image_loop import ImageLoop
from kendama_cli.devices.camera.interface import SceneSource, open_cameras
from kendama_cli.errors import ConfigError
from kendama_cli.robot_model.model import ToolPose
from kendama_cli.schema.arrays import Array
from kendama_cli.settings.camera import CameraSettings, LightingSettings
from kendama_cli.settings.game import GameSettings
from kendama_cli.vision.cameras.camera_model import CameraModel
from kendama_cli.vision.prediction.tracker import ball_tracker
from kendama_cli.vision.settings import PredictSettings

LinkPose = Callable[[str, Array], ToolPose]
"""Function of a link's name and the joint angles (n,) that returns its pose in the world."""
STALE_FRAMES = 3.0
"""A camera whose newest frame is older than so many of its periods is without one."""
STAMP_DECIMALS = 6
"""Two cameras of a game exposed together where their stamps agree to a microsecond."""
OTHERWISE = "or choose transfer.observation.source=tracking"


@dataclass(frozen=True)
class CameraSetup:
    """Settings of cameras and images."""

    camera: CameraSettings
    lighting: LightingSettings
    predict: PredictSettings


def check_cameras(cameras: CameraSetup, observation: ObservationSettings, *, realtime: bool) -> None:
    """Raise ConfigError where games cannot be observed so."""
    if observation.source == "tracking":
        return
    camera, timing, key = cameras.camera, cameras.camera.timing, "camera.kind"
    if camera.source == "recorded":
        problem = f"'camera.kind' is '{camera.kind}': a recording cannot show a game; use camera=virtual"
    elif len(camera.cameras) < 2:
        key, fault = "camera.cameras", "has one camera; to detect free flight two are needed that expose together"
        problem = f"'{key}' {fault}; add one"
    elif timing is not None and timing.stagger_s > 0:
        key, fault = "camera.stagger_s", "to detect free flight the cameras must expose together"
        problem = f"'{key}' is {timing.stagger_s}; {fault}; set 0"
    elif camera.source == "rendered" and realtime:
        fault = "with a robot in real time, whose scene cannot be rendered in time"
        problem = f"'camera.kind' is '{camera.kind}' {fault}; use camera=device"
    else:
        return
    raise ConfigError(key, f"{problem}, {OTHERWISE}")


@contextmanager
def open_observer(
    cameras: CameraSetup,
    observation: ObservationSettings,
    game: GameSettings,
    *,
    cup_place: Callable[[Array], Array],
    link_pose: LinkPose,
    history: SceneHistory,
    geometry: CatchGeometry,
) -> Iterator[FlightObserver]:
    """Open the observer of games on ``geometry``, with the tie point at ``cup_place`` (joint angles); close it at last.

    ``link_pose`` (link's name, joint angles) places cameras on links: virtual ones by the true angles, the tracker's
    models by the measured ones.
    Raises MissingPartError where a camera is not there, ConfigError where ``history`` has nothing for virtual ones.
    """
    rim_m, catch_m = geometry.rim_height_m, geometry.catch_height_m
    camera = cameras.camera
    rate_hz = camera.rate_hz
    if observation.source == "tracking" or camera.source == "recorded" or rate_hz is None:
        predict, sigma_m = cameras.predict, [observation.position_sigma_m] * 3
        tracker = PositionTracker(predict.onset, predict.motion, game, rim_height_m=rim_m, sigma_m=sigma_m)
        yield MarkerObserver(tracker, observation, rim_m=rim_m, catch_m=catch_m)
        return
    if camera.source == "rendered" and not history.reported:
        raise ConfigError(
            "camera.kind",
            f"'camera.kind' is '{camera.kind}', but this robot does not report where everything is; "
            f"use camera=device, {OTHERWISE}",
        )
    clock = CameraClock(observation.processing_s, live=camera.source == "live")
    rngs = [np.random.default_rng(0) for _ in camera.cameras]  # every game sets them to its own stream
    truly = partial(_placed, link_pose, history.origin_m, history.position_rad)
    opened = open_cameras(camera, clock, SceneSource(history, game, cameras.lighting, rngs, placed=truly))
    try:
        models, above_m = [one.model for one in opened], rim_m - float(history.origin_m[2])
        loop = ImageLoop(
            opened,
            ball_tracker(cameras.predict, game, models, rim_height_m=above_m, onset=True),
            now_s=lambda: clock.now_s,
            period_s=1 / rate_hz,
            max_age_s=STALE_FRAMES / rate_hz,
            stamp_decimals=STAMP_DECIMALS,
            placed=lambda model, t_s: _placed(link_pose, history.origin_m, observer.position_rad, model, t_s),
        )
        observer = CameraObserver(
            loop,
            observation,
            cup_place=cup_place,
            clock=clock,
            rngs=rngs,
            origin_m=history.origin_m,
            rim_m=rim_m,
            catch_m=catch_m,
        )
        loop.on_stale = observer.report_stale
        yield observer
    finally:
        for one in opened:
            one.close()


def _placed(
    link_pose: LinkPose, origin_m: Array, position_rad: Callable[[float], Array], model: CameraModel, t_s: float
) -> CameraModel:
    """Return a camera on a link in the cameras' frame, where the joint angles of ``t_s`` put it."""
    pose = link_pose(model.link or "", position_rad(t_s))
    return model.carried(pose.rotation, pose.position_m - origin_m)
