"""Noise of a detector along flights, learned from the detections that runs have logged."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from scipy.optimize import minimize

from kendama_cli.devices.camera.calibration import camera_models
from kendama_cli.errors import InputError
from kendama_cli.log.container import MAGIC as MCAP_MAGIC
from kendama_cli.log.messages import DetectionMessage
from kendama_cli.log.reader import LogFile, logged_settings
from kendama_cli.plugins.calibration.flight_calibration import PRIORS
from kendama_cli.schema.arrays import Array
from kendama_cli.schema.settings import build_value
from kendama_cli.settings.camera import CameraSettings
from kendama_cli.settings.game import GameSettings
from kendama_cli.vision.cameras.triangulation import RayConstraints
from kendama_cli.vision.detection.interface import Sighting
from kendama_cli.vision.prediction.free_flight import FreeFlight
from kendama_cli.vision.prediction.kalman_flight import KalmanFlightFit
from kendama_cli.vision.prediction.tracker import ball_sight, flight_estimator
from kendama_cli.vision.settings import ColouredMotion, PredictSettings

FEWEST_FLIGHTS, MOST_FLIGHTS = 5, 30
FEWEST_DETECTIONS = 12
"""A flight with fewer detections says nothing about their noise: six of its numbers are unknown."""
NOISE_SCALE = (1.0, 1.5)
"""Median and spread (natural log) of the multiple of what a detector states."""

RUN = "run predict or games through cameras first"

LENGTH_S = 0.2
"""Correlation time of the wobble: half a flight. A slower one looks like the flight itself, so none is learned."""

Sights = list[tuple[float, RayConstraints]]
DetectedFlight = tuple[FreeFlight, Sights]
"""A flight's measurements, with the model of flight in the game of its log."""


def detected(path: Path) -> bool:
    """Return True if the file is the log of a run whose cameras saw flights."""
    with path.open("rb") as file:
        ours = file.read(len(MCAP_MAGIC)) == MCAP_MAGIC
    return ours and _topic(LogFile(path)) is not None


def _topic(log: LogFile) -> str | None:
    return next((topic for topic in log.topics if topic.endswith("/detection")), None)


def detected_flights(path: Path) -> list[DetectedFlight]:
    """Return the measurements of each flight in a run's log, from its first estimate on.

    From there to the predicted catch the ball is known to fly. Raises InputError for a log without settings of cameras.
    """
    log = LogFile(path)
    topic, settings = _topic(log), log.stage.get("settings", {})
    if topic is None or not {"camera", "game", "predict"} <= settings.keys():
        raise InputError(str(path), "it has no detections with the settings of their cameras", remedy=RUN)
    game = logged_settings(GameSettings, settings["game"], "game", path)
    predict = logged_settings(PredictSettings, settings["predict"], "predict", path)
    models = camera_models(build_value(CameraSettings, settings["camera"], "camera"))
    if any(model.link is not None for model in models):
        raise InputError(str(path), "a link of the arm carries its cameras", remedy="use cameras that stand still")
    cameras = {model.name: model for model in models}
    estimates = log.table(topic.replace("detection", "estimate"))
    numbers, begin_s, catch_s = (
        estimates[name].to_numpy(np.float64)
        for name in ("flight" if "flight" in estimates else "game", "t_s", "t_catch_s")
    )
    spans = {
        int(one): (float(begin_s[numbers == one][0]), float(catch_s[numbers == one][-1])) for one in np.unique(numbers)
    }
    flights: dict[int, Sights] = {flight: [] for flight in spans}
    detections = log.messages(topic, DetectionMessage)
    for t_s, seen in zip(detections.t_s, detections.messages, strict=True):
        first_s, last_s = spans.get(seen.flight, (np.inf, 0.0))
        if seen.seen and first_s <= t_s < last_s:
            flights[seen.flight].append((float(t_s), ball_sight(cameras[seen.camera], _sighting(seen))))
    flight = flight_estimator(predict, game, game.cup.rim_m).flight
    return [(flight, one) for one in flights.values() if len(one) >= FEWEST_DETECTIONS]


def fit_noise(flights: Sequence[DetectedFlight]) -> ColouredMotion:
    """Fit noise and wobble under which the detections of ``flights`` are most likely, all flights together.

    The likelihood is that of the Kalman filter's innovations, times the wide log-normal priors of
    ``fit_flight_model``. Raises ValueError for fewer than FEWEST_FLIGHTS.
    """
    if len(flights) < FEWEST_FLIGHTS:
        raise ValueError(f"{len(flights)} flights with {FEWEST_DETECTIONS} detections; {FEWEST_FLIGHTS} are needed")
    chosen = np.unique(np.linspace(0, len(flights) - 1, MOST_FLIGHTS).round().astype(int))
    priors = (NOISE_SCALE, PRIORS["wobble_m"])
    medians, spreads = np.log([median for median, _ in priors]), np.array([spread for _, spread in priors])

    def motion(scaled: Array) -> ColouredMotion:
        noise_scale, sigma_m = np.exp(medians + spreads * scaled).tolist()
        return ColouredMotion("coloured", noise_scale, sigma_m, LENGTH_S, 0.0)

    def loss(scaled: Array) -> float:
        total, tried = 0.5 * float(scaled @ scaled), motion(scaled)
        for number in chosen:
            flight, sights = flights[number]
            fit = KalmanFlightFit(flight, tried)
            for t_s, sight in sights:
                fit.add(t_s, sight)
            total -= fit.log_likelihood
        return total

    corners = np.vstack([np.zeros(len(priors)), 0.5 * np.eye(len(priors))])
    best = minimize(
        loss,
        corners[0],
        method="Nelder-Mead",
        options={"maxiter": 80, "xatol": 0.03, "fatol": 0.1, "initial_simplex": corners},
    )
    return motion(np.asarray(best.x, dtype=np.float64))


def _sighting(seen: DetectionMessage) -> Sighting:
    covariance = np.array(list(seen.covariance_px2)).reshape(2, 2)
    return Sighting(np.array([seen.u_px, seen.v_px]), covariance, seen.radius_px, 1.0)
