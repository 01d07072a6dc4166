"""Truth of the told uncertainty of a predicted catch: errors over their own covariances, of many flights.

    python -m tests.plugins.calibration.uncertainty [stated] CELL [FLIGHTS] [SEED]

prints a row per observed fraction. With S the told covariance of the crossing in the rim plane and e its error, the
mean of e^T S^-1 e is 2 if S is true, its median 1.39, and 95 % are below 5.99; the mean of (time error / its sigma)^2
is 1. Intervals are bootstrapped over flights. CELL is ``colour`` (a red ball), ``trained`` (the red ball, five boxes),
``halves`` (a spinning ball of two halves, five boxes), or ``marker`` (positions of a marker 4 mm off the centre of a
spinning ball). Noise is learned from LEARNED other flights, as 'kendama log predict' learns it from their log;
``stated`` takes what detectors state.
"""

from __future__ import annotations

import dataclasses
import sys
import tempfile
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from kendama_cli.artifacts.catch_pose import CatchPose
from kendama_cli.log.writer import McapLog, MemoryFile
from kendama_cli.plugins.calibration.detector_noise import detected_flights, fit_noise
from kendama_cli.plugins.calibration.flight_search import RecordedFlight
from kendama_cli.plugins.calibration.flight_trial import try_flights
from kendama_cli.plugins.calibration.log_predict import SEEN, WITHIN_95
from kendama_cli.plugins.films.ball_box import BallBox, TrainedImage
from kendama_cli.plugins.films.settings import TrainedDetectorSettings
from kendama_cli.plugins.films.training import teach
from kendama_cli.schema.settings import build
from kendama_cli.settings.camera import VirtualCamera
from kendama_cli.stages.predict import STAGE
from kendama_cli.stages.predict.stage import FlightStudy
from tests.memory_context import MemoryContext
from tests.plugins.shared.flights import throw
from tests.shipped_conf import plain
from tests.vision.scenes import game, lighting, predict

BOXES, LEARNED = 5, 20
RATE_HZ, MARKER_M, SPIN_HZ = 120.0, 4e-3, (0.5, 2.5)
Row = tuple[float, float]
"""e^T S^-1 e of a prediction's place, and the square of its time error over sigma."""


class WatchedStudy(FlightStudy):
    """A study of predictions that keeps each prediction beside the truth."""

    def __init__(self, settings: Any, camera: Any, seed: int) -> None:
        self.context = MemoryContext(seed=seed)
        self.context.log = McapLog(STAGE.topics, MemoryFile())
        super().__init__(settings, camera, game(), lighting("bright"), ctx=self.context)
        self.told: list[list[Row]] = []

    def flight(self, number: int) -> Any:
        self.told.append([])
        return super().flight(number)

    def _compare(self, number: int, fraction: float, pose: CatchPose | None) -> Any:
        staged = self._staged
        if pose is None:
            self.told[-1].append((np.nan, np.nan))
        else:
            off, late_s = (pose.position_m - staged.release.crossing_m)[:2], pose.t_s - staged.crossing_s
            square = off @ np.linalg.solve(pose.covariance_m2[:2, :2], off)
            self.told[-1].append((float(square), (late_s / pose.time_sigma_s) ** 2))
        return super()._compare(number, fraction, pose)

    def images(self) -> Iterator[TrainedImage]:
        """Yield whole images of random instants of random flights, a box about the ball of each."""
        rng = self.context.rng("boxes")
        while True:
            staged = self._stage()
            self._now_s = staged.seen_until_s(rng.uniform(0.05, 0.95))
            camera = self._loop.cameras[rng.integers(len(self._loop.cameras))]
            camera.set_region_of_interest(None)
            frame = camera.latest(max_age_s=1.0)
            ball = staged.ball_m(frame.t_s)
            (u, v), radius = camera.model.project(ball)[0], camera.model.size_px(ball, game().ball.radius_m)
            yield TrainedImage(frame.pixels.copy(), (BallBox(float(u), float(v), 2 * radius, 2 * radius),))


def camera_of(appearance: str) -> VirtualCamera:
    """The shipped virtual cameras, the ball painted by ``conf/camera/appearance``."""
    node = plain("camera", "virtual")
    node["appearance"] = plain("camera/appearance", appearance)
    return build(VirtualCamera, node, "camera")


def rendered(cell: str, flights: int, seed: int, *, learned: bool) -> list[list[Row]]:
    """Rows of each flight of one cell, its detector and noise learned on other flights."""
    camera = camera_of("two_tone" if cell == "halves" else "plain")
    settings = dataclasses.replace(predict(), image_every=0)
    with tempfile.TemporaryDirectory() as scratch:
        if cell != "colour":
            images = WatchedStudy(settings, camera, seed + 1).images()
            file = Path(scratch) / "ball.npz"
            file.write_bytes(teach([next(images) for _ in range(BOXES)]).to_bytes())
            node = plain("predict/detector", "trained") | {"ball": str(file)}
            settings = dataclasses.replace(settings, detector=build(TrainedDetectorSettings, node, "predict.detector"))
        if learned:
            other, log = WatchedStudy(settings, camera, seed + 2), Path(scratch) / "predict.mcap"
            for number in range(LEARNED):
                other.flight(number)
            nodes = {"predict": settings, "camera": camera, "game": game()}
            facts = {name: dataclasses.asdict(node) for name, node in nodes.items()}
            other.context.log.finish(log, stage="predict", settings=facts, metrics={})
            settings = dataclasses.replace(settings, motion=fit_noise(detected_flights(log)))
            print(f"learned: {settings.motion}", flush=True)
        made = WatchedStudy(settings, camera, seed)
        for number in range(flights):
            made.flight(number)
    return made.told


def markers(flights: int, seed: int, *, learned: bool) -> list[list[Row]]:
    """Rows of throws whose marker sits off the centre of a ball that spins, each throw about an axis of its own."""
    rng, made = np.random.default_rng(seed), []
    for _ in range(LEARNED + flights):
        axes = np.linalg.qr(rng.standard_normal((3, 3)))[0][:2]
        turned, path = (
            2 * np.pi * rng.uniform(*SPIN_HZ) * np.arange(200) / RATE_HZ,
            throw(rng, rate_hz=RATE_HZ, held_s=0.0),
        )
        last = int(np.searchsorted(path[0], path[2]))
        off = MARKER_M * (np.cos(turned)[:, None] * axes[0] + np.sin(turned)[:, None] * axes[1])
        made.append(RecordedFlight("ball", 0.0, path[0][:last], path[1][:last] + off[:last]))
    trial = try_flights(made[LEARNED:], SEEN, made[:LEARNED] if learned else [])
    print(f"learned: {trial.model.motion}, sigma {trial.model.sigma_m:.2g} m", flush=True)
    return np.stack([trial.squared_sigmas, trial.time_sigmas**2], axis=-1).tolist()


def main(arguments: list[str]) -> None:
    """Print the table of one cell."""
    learned = arguments[:1] != ["stated"]
    cell, *rest = arguments if learned else arguments[1:]
    flights, seed = (int(value) for value in (*rest, *("100", "84000")[len(rest) :]))
    make = markers if cell == "marker" else partial(rendered, cell)
    told = np.array(make(flights, seed, learned=learned))
    print("seen  flights  mean e'S^-1e [95 %]   median  inside 95 %  time [95 %]")
    for fraction, rows in zip(SEEN, told.swapaxes(0, 1), strict=True):
        square, late = rows[np.isfinite(rows).all(axis=1)].T
        print(
            f"{fraction:.1f}  {len(square):4}  {_mean(square)}  {np.median(square):.2f}  "
            f"{np.mean(square < WITHIN_95):.2f}  {_mean(late)}",
            flush=True,
        )


def _mean(values: Any) -> str:
    draws = np.random.default_rng(0).choice(values, (2000, len(values))).mean(axis=1)
    low, high = np.quantile(draws, (0.025, 0.975))
    return f"{values.mean():.2f} [{low:.2f}, {high:.2f}]"


if __name__ == "__main__":
    main(sys.argv[1:])
