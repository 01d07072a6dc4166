"""Result of one flight of the study, its form in a checkpoint, and the artifact and metrics of all flights."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from kendama_cli.artifacts.prediction import PredictionStudy
from kendama_cli.schema.arrays import Array
from kendama_cli.stages.interface import Metric, StageResult
from kendama_cli.vision.settings import PredictSettings


@dataclass(frozen=True)
class FlightFigures:
    """Result of one flight: horizons and errors (h,), frames and detections, and the time of its declared onset
    [ms].

    A negative ``onset_ms`` is a false alarm: free flight declared on a taut rope; nan where none was declared.
    """

    horizon_ms: Array
    position_error_mm: Array
    time_error_ms: Array
    frames: int
    seen: int
    onset_ms: float


def to_columns(flights: Sequence[FlightFigures]) -> dict[str, Array]:
    """Return one array per field, flights along its first axis, for a checkpoint."""
    return {field.name: np.array([getattr(one, field.name) for one in flights]) for field in fields(FlightFigures)}


def from_columns(columns: Mapping[str, Any]) -> list[FlightFigures]:
    """Return the flights of ``to_columns``."""
    rows = zip(*(columns[field.name] for field in fields(FlightFigures)), strict=True)
    return [
        FlightFigures(horizon, position, time, int(frames), int(seen), float(onset))
        for horizon, position, time, frames, seen, onset in rows
    ]


def made_of(settings: PredictSettings, flights: Sequence[FlightFigures]) -> StageResult:
    """Return the artifact, and the metrics at the stated part of the flight, over the flights that were predicted
    at all.
    """
    study = PredictionStudy(
        seen_fraction=np.array(settings.observed_fractions),
        horizon_ms=np.array([one.horizon_ms for one in flights]),
        position_error_mm=np.array([one.position_error_mm for one in flights]),
        time_error_ms=np.array([one.time_error_ms for one in flights]),
    )
    stated = settings.observed_fractions.index(settings.stated_fraction)
    position, time = study.position_error_mm[:, stated], study.time_error_ms[:, stated]
    predicted = np.isfinite(position)
    metrics: dict[str, Metric] = {
        "position_error_mm_p50": _quantile(position[predicted], 0.5),
        "position_error_mm_p95": _quantile(position[predicted], 0.95),
        "time_error_ms_p50": _quantile(time[predicted], 0.5),
        "time_error_ms_p95": _quantile(time[predicted], 0.95),
        "time_error_rms_ms": float(np.sqrt((time[predicted] ** 2).mean())) if predicted.any() else None,
        "prediction_horizon_ms": _quantile(study.horizon_ms[:, stated], 0.5),
        "observed_fraction": settings.stated_fraction,
        "flights": settings.flights,
        "predicted_rate": float(predicted.mean()),
        "detection_rate": sum(one.seen for one in flights) / max(sum(one.frames for one in flights), 1),
    }
    if settings.onset_from == "images":
        onset = np.array([one.onset_ms for one in flights])
        declared = np.isfinite(onset)
        delay = onset[declared & (onset >= 0)]
        metrics["onset_delay_ms_p50"] = _quantile(delay, 0.5)
        metrics["onset_delay_ms_p95"] = _quantile(delay, 0.95)
        metrics["onset_false_alarms"] = int((onset[declared] < 0).sum())
    return StageResult(study, metrics)


def _quantile(values: Array, part: float) -> float | None:
    return float(np.quantile(values, part)) if len(values) else None
