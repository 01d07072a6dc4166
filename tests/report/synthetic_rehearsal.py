"""The made-up log of a first try: two joints that follow late, and a twin that follows at once."""

from __future__ import annotations

from typing import Any

import numpy as np

from tests.log.made_logs import FieldLog


def write_rehearsal(log: FieldLog, rng: np.random.Generator) -> tuple[dict[str, Any], dict[str, Any]]:
    """Every topic of the stage ``rehearse`` at 100 Hz; returns settings and metrics."""
    for time in np.arange(0.01, 4.0, 0.01):
        for topic, late in (("ghost", 0.0), ("sent", 0.0), ("measured", 0.02), ("external", 0.02)):
            angles = 0.3 * np.sin(np.array([1.0, 2.0]) * (time - late)) + 1e-4 * rng.standard_normal(2) * (late > 0)
            joints = {"names": ["shoulder", "elbow"], "position_rad": angles, "velocity_rad_s": [0.0, 0.0]}
            log.write(f"/rehearse/{topic}", time, joints | {"effort_nm": [1.0, 2.0]})
    metrics = {
        "speed": 0.3,
        "completed": True,
        "tracking_error_rms_mrad": 6.5,
        "tracking_error_max_mrad": 12.0,
        "played_s": 4.0,
    }
    return {"rehearse": {"speed": 0.3, "max_tracking_error_rad": 0.15, "max_twin_deviation_rad": 0.1}}, metrics
