"""A look through cameras as games take it (rate, delay, what is detected): the work of ``camera check``."""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from kendama_cli.cli import render
from kendama_cli.cli.output_file import refuse_output, write_output
from kendama_cli.config.compose import composed
from kendama_cli.config.site import Site
from kendama_cli.devices.camera.image_loop import ImageLoop, ObservedImage, raise_stale
from kendama_cli.devices.camera.interface import Camera, SceneSource, StaleFrame, open_cameras
from kendama_cli.devices.camera.staged_flight import StagedFlight
from kendama_cli.errors import StageError
from kendama_cli.pipeline.inputs import resolve_files
from kendama_cli.pipeline.nodes import build_settings
from kendama_cli.plugins.shared.videos.clock import Clock
from kendama_cli.plugins.shared.videos.pictures import as_png, check_picture
from kendama_cli.rendering.scene import ScenePose
from kendama_cli.settings.camera import CameraSettings, LightingSettings
from kendama_cli.settings.game import GameSettings
from kendama_cli.vision.detection.interface import Sighting
from kendama_cli.vision.prediction.release import draw_release
from kendama_cli.vision.prediction.tracker import ball_tracker
from kendama_cli.vision.settings import PredictSettings

POLL_S = 0.0005
DEFAULT_RATE_HZ = 30.0
"""Where a recording leaves its rate open; nothing that is checked depends on it."""
SILENCE_S = 2.0
"""A live camera that gives nothing for so long has stopped."""


@dataclass
class CameraRecord:
    """Record of one camera: stamps, ages on arrival, times to detect, detections.

    ``shown`` is its last image with the ball in it, or its first, and the detection there.
    """

    stamps_s: list[float] = field(default_factory=list)
    ages_s: list[float] = field(default_factory=list)
    detect_s: list[float] = field(default_factory=list)
    sightings: list[Sighting | None] = field(default_factory=list)
    doubled: int = 0
    newest: NDArray[np.uint8] | None = None
    shown: tuple[NDArray[np.uint8], Sighting | None] | None = None


def check_cameras(
    camera: CameraSettings,
    lighting: LightingSettings,
    game: GameSettings,
    predict: PredictSettings,
    *,
    seconds: float,
    seed: int,
) -> dict[str, CameraRecord]:
    """Look through all cameras for ``seconds``: of a virtual scene with flights, of a recording, or of the clock.

    Raises what opening the cameras raises, and StaleFrame where a live one gives nothing.
    """
    now, flights = Clock(live=camera.source == "live"), _Flights(game, predict, np.random.default_rng([seed, 1]))
    rngs = [np.random.default_rng([seed, 2, number]) for number in range(len(camera.cameras))]
    opened = open_cameras(camera, now, SceneSource(flights.scene, game, lighting, rngs))
    records = {one.model.name: CameraRecord() for one in opened}
    try:
        loop = ImageLoop(
            opened,
            ball_tracker(predict, game, [one.model for one in opened], rim_height_m=game.cup.rim_m, onset=True),
            now_s=now,
            period_s=1 / (camera.rate_hz or DEFAULT_RATE_HZ),
            max_age_s=SILENCE_S if now.live else np.inf,
            on_stale=raise_stale if now.live else _raise_unless_coming,
        )
        for _ in _moments(opened, now, seconds):
            for image in loop.take():
                _record(records[image.camera], image, live=now.live)
    finally:
        for one in opened:
            one.close()
    return records


def figures(record: CameraRecord) -> dict[str, Any]:
    """Return the figures of one camera: frames, rate, missed and doubled frames, delays, fraction of detections."""
    stamps = np.array(record.stamps_s)
    steps = np.diff(stamps)
    usual = float(np.median(steps)) if len(steps) else None
    seen = [one for one in record.sightings if one is not None]
    sigma = [float(np.sqrt(np.trace(one.covariance_px2) / 2)) for one in seen]
    return {
        "frames": len(stamps),
        "rate_hz": None if not usual else 1 / usual,
        "missed": int(sum(round(float(step) / usual) - 1 for step in steps)) if usual else 0,
        "doubled": record.doubled,
        "latency_ms_p50": _quantile(record.ages_s, 0.5, 1e3),
        "latency_ms_p95": _quantile(record.ages_s, 0.95, 1e3),
        "detection_ms_p50": _quantile(record.detect_s, 0.5, 1e3),
        "detection_ms_p95": _quantile(record.detect_s, 0.95, 1e3),
        "seen": len(seen) / len(stamps) if len(stamps) else 0.0,
        "radius_px_p50": _quantile([one.radius_px for one in seen], 0.5),
        "sigma_px_p50": _quantile(sigma, 0.5),
    }


def _quantile(values: Sequence[float], part: float, scale: float = 1.0) -> float | None:
    return float(np.quantile(values, part)) * scale if values else None


class _Flights:
    """One release after another, for virtual cameras to look at."""

    def __init__(self, game: GameSettings, predict: PredictSettings, rng: np.random.Generator) -> None:
        self._game, self._release, self._rng = game, predict.release, rng
        self._staged: list[tuple[float, StagedFlight]] = []
        self._end_s = 0.0

    def scene(self, t_s: float) -> ScenePose:
        """Return all poses."""
        while max(t_s, 0.0) >= self._end_s:
            lead_s = 0.15
            drawn = draw_release(self._rng, self._release, self._game, lead_s + 0.05)
            staged = StagedFlight(drawn, lead_s, self._game.rope.length_m)
            self._staged.append((self._end_s, staged))
            self._end_s += staged.crossing_s
        begin_s, staged = next(pair for pair in reversed(self._staged) if pair[0] <= max(t_s, 0.0))
        return staged.scene(t_s - begin_s)


def _raise_unless_coming(stale: StaleFrame) -> None:
    """Raise ``stale`` if a frame ever came: a recording may start later than another one."""
    if np.isfinite(stale.age_s):
        raise stale


def _moments(cameras: Sequence[Camera], now: Clock, seconds: float) -> Iterator[None]:
    """Let time pass to where new frames may be, until ``seconds`` are over or no frame comes any more."""
    if now.live:
        while now() < seconds:
            time.sleep(POLL_S)
            yield
    else:
        while stamps := [one.next_s for one in cameras if one.next_s is not None]:
            if min(stamps) > seconds:
                return
            now.set_s = max(min(stamps), now.set_s)
            yield


def _record(record: CameraRecord, image: ObservedImage, *, live: bool) -> None:
    frame = image.frame
    if live:  # a simulated clock knows no delay
        record.ages_s.append(image.arrived_s - frame.t_s)
    record.detect_s.append(image.detection_s)
    record.doubled += record.newest is not None and np.array_equal(record.newest, frame.pixels)
    record.newest = frame.pixels
    record.stamps_s.append(frame.t_s)
    record.sightings.append(image.sighting)
    if record.shown is None or image.sighting is not None:
        record.shown = frame.pixels, image.sighting


def check(site: Site, overrides: Sequence[str], seconds: float, output: Path | None, *, as_json: bool) -> None:
    """Look through the configured cameras, and show what they give and what the detector sees in it."""
    if output is not None:
        refuse_output(output, "a picture is a PNG", ".png")
    settings = build_settings(composed(site, overrides))
    records = check_cameras(
        resolve_files(settings["camera"], "camera", site.data_roots),
        settings["lighting"],
        settings["game"],
        resolve_files(settings["predict"], "predict", site.data_roots),
        seconds=seconds,
        seed=settings["seed"],
    )
    reported = {name: figures(one) for name, one in records.items()}
    shown = {name: one.shown for name, one in records.items() if one.shown is not None}
    if not shown:
        raise StageError(f"no camera gave a frame within {seconds:g} s; look longer, or check the recording's times")
    if output is not None:
        write_output(output, as_png(check_picture(shown)))
    if as_json:
        render.document({"cameras": reported, "picture": None if output is None else str(output)})
        return
    names = next(iter(reported.values()))
    render.table(
        [(name, *(render.figure(one[name]) for one in reported.values())) for name in names], head=("", *reported)
    )
