"""Trying the predictor on recorded flights: what it says of their end, from their first part."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from kendama_cli.plugins.calibration.flight_calibration import FlightModel, fit_flight_model
from kendama_cli.plugins.calibration.flight_search import RecordedFlight
from kendama_cli.schema.arrays import Array

END_S = 0.1
"""The end is where a parabola through so much of the flight puts it: one noisy sample is no truth."""
MOST_FOLDS = 6
FIGURES = 5


@dataclass(frozen=True)
class FlightTrial:
    """Errors (n, h) of n flights' predicted ends after h parts of them: lateral place [mm], time [ms]; nan: no answer.

    ``sigma_mm`` is the stated standard deviation along an axis of the place, sqrt(tr S / 2), ``squared_sigmas`` the
    error over it, e^T S^-1 e (2 on average where S is true), ``time_sigmas`` the time's error over its own. ``model``
    is the one learned from all flights that any prediction was calibrated on.
    """

    seen_fraction: Array
    position_error_mm: Array
    time_error_ms: Array
    sigma_mm: Array
    squared_sigmas: Array
    time_sigmas: Array
    model: FlightModel


def try_flights(
    flights: Sequence[RecordedFlight],
    observed_fractions: Sequence[float],
    calibration: Sequence[RecordedFlight] | None = None,
) -> FlightTrial:
    """Predict where and when every flight falls through its last height.

    Gravity, drag, noise and wobble are learned from ``calibration``; without it, from the other flights, the one that
    is predicted (or, of many, its group) left out.
    """
    fractions = np.array(observed_fractions)
    errors = np.full((len(flights), len(fractions), FIGURES), np.nan)
    if calibration is None and len(flights) == 1:
        calibration = ()  # no other flight to learn from
    model = fit_flight_model(flights if calibration is None else calibration)
    folds = min(len(flights), MOST_FOLDS) if calibration is None else 1
    for fold in range(folds):
        left_out = range(fold, len(flights), folds)
        others = [flight for i, flight in enumerate(flights) if i not in left_out]
        held = model if calibration is not None else fit_flight_model(others)
        for i in left_out:
            errors[i] = predict_end(flights[i], held, fractions)
    position_mm, time_ms, sigma_mm, squared, time_sigmas = np.moveaxis(errors, 2, 0)
    return FlightTrial(fractions, position_mm, time_ms, sigma_mm, squared, time_sigmas, model)


def predict_end(flight: RecordedFlight, model: FlightModel, fractions: Array) -> Array:
    """Return the figures (h, FIGURES), in FlightTrial's order, of the predicted crossing of the last height."""
    end_s = float(flight.t_s[-1])
    end = _end(flight)
    estimator = model.estimator(float(end[2]))
    covariance = model.sigma_m**2 * np.eye(3)
    errors_of_parts = np.full((len(fractions), FIGURES), np.nan)
    taken = 0
    for j, until_s in enumerate(fractions * end_s):
        while taken < len(flight.t_s) and flight.t_s[taken] <= until_s:
            estimator.update_position(float(flight.t_s[taken]), flight.position_m[taken], covariance)
            taken += 1
        pose = estimator.catch()
        if pose is not None:
            off, spread = pose.position_m[:2] - end[:2], pose.covariance_m2[:2, :2]
            late_s = abs(pose.t_s - end_s)
            errors_of_parts[j] = (
                1e3 * float(np.linalg.norm(off)),
                1e3 * late_s,
                1e3 * float(np.sqrt(np.trace(spread) / 2)),
                float(off @ np.linalg.solve(spread, off)),
                late_s / pose.time_sigma_s,
            )
    return errors_of_parts


def _end(flight: RecordedFlight) -> Array:
    last = flight.t_s >= min(flight.t_s[-1] - END_S, flight.t_s[-6])
    s = flight.t_s[last] - flight.t_s[-1]
    return np.asarray(np.linalg.lstsq(s[:, None] ** np.arange(3), flight.position_m[last], rcond=None)[0][0])
