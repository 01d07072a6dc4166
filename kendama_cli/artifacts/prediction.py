"""Predictions: how well free flights were predicted."""

from __future__ import annotations

from dataclasses import dataclass

from kendama_cli.schema.arrays import Array, array, set_arrays


@dataclass(frozen=True)
class PredictionStudy:
    """Errors of the predicted catch over n flights, each given after h parts of the flight.

    ``seen_fraction`` (h,) is the part of the flight that was seen, ``horizon_ms`` (n, h) the time then left to the
    catch; ``position_error_mm`` and ``time_error_ms`` (n, h) are the absolute errors of the crossing of the rim
    plane, nan where no prediction was made.
    """

    seen_fraction: Array
    horizon_ms: Array
    position_error_mm: Array
    time_error_ms: Array

    def __post_init__(self) -> None:
        set_arrays(self, seen_fraction=(None,))
        set_arrays(self, horizon_ms=(None, len(self.seen_fraction)))
        shape = self.horizon_ms.shape
        for name in ("position_error_mm", "time_error_ms"):
            object.__setattr__(self, name, array(name, getattr(self, name), shape, finite=False))
