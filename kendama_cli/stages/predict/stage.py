"""predict: cameras watch free flights, and the catching pose is foreseen from their images."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from functools import partial
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from kendama_cli.artifacts.catch_pose import CatchPose
from kendama_cli.artifacts.prediction import PredictionStudy
from kendama_cli.devices.camera.ball_tracker import ball_tracker
from kendama_cli.devices.camera.interface import Camera, SceneSource
from kendama_cli.devices.camera.opening import Look, look, open_cameras
from kendama_cli.devices.camera.staged_flight import StagedFlight
from kendama_cli.errors import ConfigError
from kendama_cli.log.messages import DetectionMessage
from kendama_cli.rendering.scene import ScenePose
from kendama_cli.schema.arrays import Array
from kendama_cli.schema.foxglove import CompressedImage, FrameTransform
from kendama_cli.settings.camera import CameraSettings, LightingSettings, VirtualCamera
from kendama_cli.settings.game import GameSettings
from kendama_cli.stages.interface import Made, Metric, StageContext
from kendama_cli.stages.predict.messages import CatchEstimateMessage, PredictionErrorMessage
from kendama_cli.vision.release import draw_release
from kendama_cli.vision.settings import PredictSettings

ANGLE_KNOWN_RAD = 0.02
"""The swing-up knows the rope's angle about so well: there the search for the ball begins."""
SEARCH_HALF_PX = 40.0
PAUSE_S = 0.5
"""Flights stand one after another on the log's time axis, this far apart."""
NO_NUMBER = float("nan")


@dataclass(frozen=True)
class FlightFigures:
    """What one flight gave: horizons and errors (h,), frames and sightings, and when its onset was declared [ms].

    A negative ``onset_ms`` is a false alarm: free flight declared on a taut rope; nan where none was declared.
    """

    horizon_ms: Array
    position_error_mm: Array
    time_error_ms: Array
    frames: int
    seen: int
    onset_ms: float


class Predict:
    """Measures how well the crossing of the rim plane is foreseen from images, against flights known exactly."""

    def __init__(
        self, *, predict: PredictSettings, camera: CameraSettings, game: GameSettings, lighting: LightingSettings
    ) -> None:
        self._settings, self._camera, self._game, self._lighting = predict, camera, game, lighting

    def run(self, given: Mapping[str, Any], ctx: StageContext) -> Made:
        """The study of ``predict.flights`` flights; nothing is needed from other stages."""
        settings = self._settings
        watch = _Watch(settings, self._camera, self._game, self._lighting, ctx=ctx)
        columns: dict[str, list[Any]] = {field.name: [] for field in fields(FlightFigures)}
        saved = ctx.restore()
        if saved is not None:
            columns = {name: list(saved[name]) for name in columns}
            watch.begin_s = float(saved["begin_s"])
        for number in range(len(columns["frames"]), settings.flights):
            made = watch.flight(number)
            for name, column in columns.items():
                column.append(getattr(made, name))
            state = {name: np.array(column) for name, column in columns.items()} | {"begin_s": watch.begin_s}
            ctx.checkpoint(partial(dict, state))
            stated = float(made.position_error_mm[settings.seen_fractions.index(settings.stated_fraction)])
            ctx.progress(number + 1, settings.flights, position_error_mm=stated)
        return _made(settings, {name: np.array(column) for name, column in columns.items()})


class _Watch:
    """The cameras, the tracker and the log, from flight to flight; ``begin_s`` is the flight's place in the log."""

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
        world = SceneSource(self._scene, game, lighting, rngs)
        self._cameras = open_cameras(camera, lambda: self._now_s, world)
        self._view = _virtual(camera, self._cameras, settings)
        self._tracker = ball_tracker(
            settings,
            game,
            [one.model for one in self._cameras],
            rim_height_m=game.cup.depth_m,
            onset=settings.onset_from == "images",
        )

    def flight(self, number: int) -> FlightFigures:
        """Watch one flight; after each wanted part of it, hold the prediction against the truth."""
        settings, view, tracker = self._settings, self._view, self._tracker
        staged = self._stage()
        fractions = np.array(settings.seen_fractions)
        deadlines = [staged.seen_until_s(fraction) for fraction in fractions]
        end_s = staged.crossing_s if number == 0 else max(deadlines)
        known = settings.onset_from == "truth"
        frame = math.ceil((staged.release_s + view.sensor.exposure_s) * view.rate_hz) if known else 0
        tracker.reset()
        blur = self._ctx.rng("releases").normal(0.0, ANGLE_KNOWN_RAD * self._game.rope.length_m, 3)
        tracker.expect(staged.ball_m(frame / view.rate_hz) + blur, SEARCH_HALF_PX)
        errors: list[Array] = []
        pose: CatchPose | None = None
        frames = seen = 0
        while (t_s := frame / view.rate_hz) < end_s:
            while len(errors) < len(fractions) and deadlines[len(errors)] < t_s:
                errors.append(self._hold(number, fractions[len(errors)], pose))
            pictured = number == 0 and settings.image_every > 0 and frame % settings.image_every == 0
            self._now_s = t_s + view.sensor.exposure_s / 2 + 1e-9
            tie_m = staged.tie_m(t_s)
            moment = look(self._cameras, tracker, t_s, tie_m, max_age_s=2 / view.rate_hz, whole=pictured)
            pose = moment.pose
            frames += len(moment.sightings)
            seen += sum(sighting is not None for sighting in moment.sightings.values())
            self._tell(number, moment, pictured)
            frame += 1
        errors += [self._hold(number, fraction, pose) for fraction in fractions[len(errors) :]]
        self.begin_s += staged.crossing_s + PAUSE_S
        onset_ms = 1e3 * (tracker.found.declared_s - staged.release_s) if tracker.found else NO_NUMBER
        position_mm, time_ms = np.array(errors).T
        left_ms = 1e3 * (1 - fractions) * staged.release.crossing_s
        return FlightFigures(left_ms, position_mm, time_ms, frames, seen, onset_ms)

    def _scene(self, t_s: float) -> ScenePose:
        return self._staged.scene(t_s)

    def _stage(self) -> StagedFlight:
        release, view, rng = self._settings.release, self._view, self._ctx.rng("releases")
        lead_s = (release.taut_frames + 1) / view.rate_hz
        drawn = draw_release(rng, release, self._game, lead_s + 1 / view.rate_hz + view.sensor.exposure_s)
        self._staged = StagedFlight(drawn, lead_s + float(rng.uniform(0, 1 / view.rate_hz)), self._game.rope.length_m)
        for camera in self._cameras:
            camera.restart()
        return self._staged

    def _hold(self, number: int, fraction: float, pose: CatchPose | None) -> Array:
        """Errors [mm, ms] of ``pose`` after ``fraction`` of the flight; nan without a prediction."""
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

    def _tell(self, number: int, moment: Look, pictured: bool) -> None:
        """Log one moment: images of the first flight, sightings, the truth, the estimate."""
        t_s, log = self.begin_s + moment.t_s, self._ctx.log
        for name, sighting in moment.sightings.items():
            if pictured:
                jpeg = _jpeg(moment.frames[name].pixels, self._settings.jpeg_quality)
                log.write(f"/predict/image/{name}", t_s, CompressedImage(name, "jpeg", jpeg))
            place = (NO_NUMBER, NO_NUMBER) if sighting is None else sighting.centre_px
            log.write(
                "/predict/detection",
                t_s,
                DetectionMessage(
                    flight=number,
                    camera=name,
                    u_px=float(place[0]),
                    v_px=float(place[1]),
                    radius_px=NO_NUMBER if sighting is None else sighting.radius_px,
                    seen=sighting is not None,
                ),
            )
        ball_m = self._staged.ball_m(moment.t_s)
        log.write("/predict/ball", t_s, FrameTransform("world", "ball", ball_m))
        if moment.pose is not None:
            log.write("/predict/estimate", t_s, _estimate(number, self.begin_s, moment.pose))


def _virtual(camera: CameraSettings, opened: Sequence[Camera], settings: PredictSettings) -> VirtualCamera:
    """The settings of virtual cameras that can show a known flight; raises ConfigError for any other."""
    if not isinstance(camera, VirtualCamera):
        for one in opened:
            one.close()
        raise ConfigError(
            "camera.kind",
            f"'camera.kind' is '{camera.kind}', but predict holds its errors against flights known exactly; "
            "choose camera=virtual",
        )
    if camera.stagger_s >= 1 / camera.rate_hz:
        raise ConfigError("camera.stagger_s", f"'camera.stagger_s' is {camera.stagger_s}; allowed: below 1/rate_hz")
    if settings.onset_from == "images" and (len(opened) < 2 or camera.stagger_s > 0):
        raise ConfigError(
            "predict.onset_from",
            "'predict.onset_from' is 'images', which needs two cameras that expose together (camera.stagger_s=0); "
            "add a camera, or choose predict.onset_from=truth",
        )
    return camera


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
    )


def _made(settings: PredictSettings, columns: Mapping[str, Array]) -> Made:
    """The artifact, and the metrics at the stated part of the flight: over the flights that were predicted at all."""
    study = PredictionStudy(
        seen_fraction=np.array(settings.seen_fractions),
        horizon_ms=columns["horizon_ms"],
        position_error_mm=columns["position_error_mm"],
        time_error_ms=columns["time_error_ms"],
    )
    stated = settings.seen_fractions.index(settings.stated_fraction)
    position, time, onset = study.position_error_mm[:, stated], study.time_error_ms[:, stated], columns["onset_ms"]
    predicted, noticed = np.isfinite(position), np.isfinite(onset)
    metrics: dict[str, Metric] = {
        "position_error_mm_p50": _quantile(position[predicted], 0.5),
        "position_error_mm_p95": _quantile(position[predicted], 0.95),
        "time_error_ms_p50": _quantile(time[predicted], 0.5),
        "time_error_ms_p95": _quantile(time[predicted], 0.95),
        "time_error_rms_ms": float(np.sqrt((time[predicted] ** 2).mean())) if predicted.any() else None,
        "horizon_ms": _quantile(study.horizon_ms[:, stated], 0.5),
        "seen_fraction": settings.stated_fraction,
        "flights": settings.flights,
        "predicted_rate": float(predicted.mean()),
        "detection_rate": float(columns["seen"].sum() / max(columns["frames"].sum(), 1)),
    }
    if settings.onset_from == "images":
        delay = onset[noticed & (onset >= 0)]
        metrics["onset_delay_ms_p50"] = _quantile(delay, 0.5)
        metrics["onset_delay_ms_p95"] = _quantile(delay, 0.95)
        metrics["onset_false_alarms"] = int((onset[noticed] < 0).sum())
    return Made(study, metrics)


def _quantile(values: Array, part: float) -> float | None:
    return float(np.quantile(values, part)) if len(values) else None
