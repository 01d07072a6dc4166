"""predict: cameras observe free flights, and the catching pose is predicted from their images."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from functools import partial
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from kendama_cli.artifacts.catch_pose import CatchPose
from kendama_cli.devices.camera.image_loop import ImageLoop, ObservedImage
from kendama_cli.devices.camera.interface import Camera, SceneSource, open_cameras
from kendama_cli.devices.camera.staged_flight import StagedFlight
from kendama_cli.errors import ConfigError
from kendama_cli.rendering.scene import ScenePose
from kendama_cli.schema.arrays import Array
from kendama_cli.schema.foxglove import CompressedImage, FrameTransform
from kendama_cli.settings.camera import CameraSettings, FrameTiming, LightingSettings
from kendama_cli.settings.game import GameSettings
from kendama_cli.stages.interface import StageContext, StageResult
from kendama_cli.stages.predict.figures import FlightFigures, from_columns, made_of, to_columns
from kendama_cli.stages.predict.messages import CatchEstimateMessage, PredictionErrorMessage
from kendama_cli.vision.detection.interface import detection_message
from kendama_cli.vision.prediction.release import draw_release
from kendama_cli.vision.prediction.tracker import ball_tracker
from kendama_cli.vision.settings import PredictSettings


class Predict:
    """Stage that measures how well images predict the rim's crossing, against flights known exactly."""

    def __init__(
        self, *, predict: PredictSettings, camera: CameraSettings, game: GameSettings, lighting: LightingSettings
    ) -> None:
        self._settings, self._camera, self._game, self._lighting = predict, camera, game, lighting

    def run(self, given: Mapping[str, Any], ctx: StageContext) -> StageResult:
        """Run the study of ``predict.flights`` flights; nothing is needed from other stages."""
        settings = self._settings
        study = FlightStudy(settings, self._camera, self._game, self._lighting, ctx=ctx)
        flights: list[FlightFigures] = []
        saved = ctx.restore()
        if saved is not None:
            flights = from_columns(saved)
            study.begin_s = float(saved["begin_s"])
        while len(flights) < settings.flights:
            flights.append(study.flight(len(flights)))
            ctx.checkpoint(partial(dict, to_columns(flights), begin_s=study.begin_s))
            stated = flights[-1].position_error_mm[settings.observed_fractions.index(settings.stated_fraction)]
            ctx.progress(len(flights), settings.flights, position_error_mm=float(stated))
        return made_of(settings, flights)


ANGLE_KNOWN_RAD = 0.02
"""The swing-up knows the rope's angle about so well: there the search for the ball begins."""
SEARCH_HALF_PX = 40.0
PAUSE_S = 0.5
"""Flights stand one after another on the log's time axis, this far apart."""
STALE_FRAMES = 2.0
NO_NUMBER = float("nan")


class FlightStudy:
    """Cameras, tracker and log, from flight to flight; ``begin_s`` is the flight's place in the log.

    Raises ConfigError for cameras that cannot show a known flight.
    """

    def __init__(
        self,
        settings: PredictSettings,
        camera: CameraSettings,
        game: GameSettings,
        lighting: LightingSettings,
        *,
        ctx: StageContext,
    ) -> None:
        self._settings, self._game, self._ctx = settings, game, ctx
        self._now_s = self.begin_s = 0.0
        self._staged: StagedFlight
        rngs = [ctx.rng(f"sensor {model.name}") for model in camera.cameras]
        scene = SceneSource(self._scene, game, lighting, rngs)
        opened = open_cameras(camera, lambda: self._now_s, scene)
        self._timing = _timing(camera, opened, settings)
        tracker = ball_tracker(
            settings,
            game,
            [one.model for one in opened],
            rim_height_m=game.cup.rim_m,
            onset=settings.onset_from == "images",
        )
        self._loop = ImageLoop(
            opened,
            tracker,
            now_s=lambda: self._now_s,
            period_s=1 / self._timing.rate_hz,
            max_age_s=STALE_FRAMES / self._timing.rate_hz,
        )

    def flight(self, number: int) -> FlightFigures:
        """Observe one flight; after each desired part of it, hold the prediction against the truth."""
        settings, timing, loop = self._settings, self._timing, self._loop
        staged = self._stage()
        fractions = np.array(settings.observed_fractions)
        deadlines = [staged.seen_until_s(fraction) for fraction in fractions]
        end_s = staged.crossing_s if number == 0 else max(deadlines)
        known = settings.onset_from == "truth"
        frame = math.ceil((staged.release_s + timing.exposure_s) * timing.rate_hz) if known else 0
        self._begin(number, frame)
        errors: list[Array] = []
        pose: CatchPose | None = None
        frames = seen = 0
        while (t_s := frame / timing.rate_hz) < end_s:
            while len(errors) < len(fractions) and deadlines[len(errors)] < t_s:
                errors.append(self._compare(number, fractions[len(errors)], pose))
            self._now_s = t_s + timing.busy_s / 2 + 1e-9
            images = loop.take()
            moments = loop.feed(images, self._now_s, staged.tie_m)
            pose = moments[-1].pose if moments else pose
            loop.aim()
            frames += len(images)
            seen += sum(image.sighting is not None for image in images)
            pictured = number == 0 and settings.image_every > 0 and frame % settings.image_every == 0
            self._log(number, images, pose, pictured=pictured)
            frame += 1
        errors += [self._compare(number, fraction, pose) for fraction in fractions[len(errors) :]]
        self.begin_s += staged.crossing_s + PAUSE_S
        found = loop.tracker.found
        onset_ms = 1e3 * (found.declared_s - staged.release_s) if found else NO_NUMBER
        position_mm, time_ms = np.array(errors).T
        left_ms = 1e3 * (1 - fractions) * staged.release.crossing_s
        return FlightFigures(left_ms, position_mm, time_ms, frames, seen, onset_ms)

    def _begin(self, number: int, frame: int) -> None:
        """Search for the ball from ``frame`` on where the swing-up would have it."""
        loop, rate_hz = self._loop, self._timing.rate_hz
        loop.whole_every = self._settings.image_every if number == 0 else 0
        loop.begin((frame - 1) / rate_hz)
        blur = self._ctx.rng("releases").normal(0.0, ANGLE_KNOWN_RAD * self._game.rope.length_m, 3)
        loop.tracker.search.expect(self._staged.ball_m(frame / rate_hz) + blur, SEARCH_HALF_PX)
        loop.aim()

    def _scene(self, t_s: float) -> ScenePose:
        return self._staged.scene(t_s)

    def _stage(self) -> StagedFlight:
        release, timing, rng = self._settings.release, self._timing, self._ctx.rng("releases")
        lead_s = (release.taut_frames + 1) / timing.rate_hz
        sampled = draw_release(rng, release, self._game, lead_s + 1 / timing.rate_hz + timing.exposure_s)
        self._staged = StagedFlight(
            sampled, lead_s + float(rng.uniform(0, 1 / timing.rate_hz)), self._game.rope.length_m
        )
        self._loop.restart()
        return self._staged

    def _compare(self, number: int, fraction: float, pose: CatchPose | None) -> Array:
        """Return the errors [mm, ms] of ``pose`` after ``fraction`` of the flight; nan without a prediction."""
        if pose is None:
            return np.full(2, np.nan)
        staged = self._staged
        position_mm = 1e3 * float(np.linalg.norm(pose.position_m - staged.release.crossing_m))
        time_ms = 1e3 * abs(pose.t_s - staged.crossing_s)
        self._ctx.log.write(
            "/predict/error",
            self.begin_s + staged.seen_until_s(fraction),
            PredictionErrorMessage(
                flight=number,
                horizon_ms=1e3 * (1 - fraction) * staged.release.crossing_s,
                position_error_mm=position_mm,
                time_error_ms=time_ms,
            ),
        )
        return np.array([position_mm, time_ms])

    def _log(self, number: int, images: Sequence[ObservedImage], pose: CatchPose | None, *, pictured: bool) -> None:
        """Log what was taken at one instant: images of the first flight, sightings, the truth, the estimate."""
        if not images:
            return
        exposed_s = max(image.frame.t_s for image in images)
        t_s, log = self.begin_s + exposed_s, self._ctx.log
        for image in images:
            if pictured:
                jpeg = _jpeg(image.frame.pixels, self._settings.jpeg_quality)
                log.write(f"/predict/image/{image.camera}", t_s, CompressedImage(image.camera, "jpeg", jpeg))
            seen = detection_message(number, image.camera, image.sighting)
            log.write("/predict/detection", self.begin_s + image.frame.t_s, seen)
        log.write("/predict/ball", t_s, FrameTransform("world", "ball", self._staged.ball_m(exposed_s)))
        if pose is not None:
            log.write("/predict/estimate", t_s, _estimate(number, self.begin_s, pose))


def _timing(camera: CameraSettings, opened: Sequence[Camera], settings: PredictSettings) -> FrameTiming:
    """Return the exposure times of cameras that can show a known flight; raises ConfigError for any other."""
    timing = camera.timing
    if camera.source != "rendered" or timing is None:
        for one in opened:
            one.close()
        raise ConfigError(
            "camera.kind",
            f"'camera.kind' is '{camera.kind}', but predict holds its errors against flights known exactly; "
            "choose camera=virtual",
        )
    if timing.stagger_s >= 1 / timing.rate_hz:
        raise ConfigError("camera.stagger_s", f"'camera.stagger_s' is {timing.stagger_s}; allowed: below 1/rate_hz")
    if settings.onset_from == "images" and (len(opened) < 2 or timing.stagger_s > 0):
        raise ConfigError(
            "predict.onset_from",
            "'predict.onset_from' is 'images', which needs two cameras that expose together (camera.stagger_s=0); "
            "add a camera, or choose predict.onset_from=truth",
        )
    return timing


def _jpeg(pixels: NDArray[np.uint8], quality: int) -> bytes:
    return cv2.imencode(".jpg", pixels, [cv2.IMWRITE_JPEG_QUALITY, quality])[1].tobytes()


def _estimate(flight: int, begin_s: float, pose: CatchPose) -> CatchEstimateMessage:
    x_m, y_m, z_m = pose.position_m.tolist()
    velocity_x, velocity_y, velocity_z = pose.velocity_m_s.tolist()
    sigma_x_m, sigma_y_m, sigma_z_m = np.sqrt(np.maximum(pose.covariance_m2.diagonal(), 0.0)).tolist()
    return CatchEstimateMessage(
        flight=flight,
        t_catch_s=begin_s + pose.t_s,
        x_m=x_m,
        y_m=y_m,
        z_m=z_m,
        velocity_x_m_s=velocity_x,
        velocity_y_m_s=velocity_y,
        velocity_z_m_s=velocity_z,
        sigma_t_s=pose.time_sigma_s,
        sigma_x_m=sigma_x_m,
        sigma_y_m=sigma_y_m,
        sigma_z_m=sigma_z_m,
        covariance_m2=pose.covariance_m2.ravel(),
    )
