"""The made-up log of a press: the tool comes down on a table beside a cylinder, a ball and a slope, and wipes."""

from __future__ import annotations

from typing import Any

import numpy as np

from tests.log.made_logs import FieldLog

BODIES: list[dict[str, Any]] = [
    {"name": "table", "kind": "static", "shape": "box", "size_m": [0.6, 0.4, 0.04], "position_m": [0.0, 0.0, 0.98]},
    {"name": "can", "kind": "free", "shape": "cylinder", "size_m": [0.03, 0.1], "position_m": [0.2, 0.0, 1.05]},
    {"name": "ball", "kind": "free", "shape": "sphere", "size_m": [0.03], "position_m": [-0.2, 0.0, 1.03]},
    {"name": "floor", "kind": "static", "shape": "plane", "size_m": [], "position_m": [0.0, 0.0, 0.0]},
]


def write_interaction(log: FieldLog, rng: np.random.Generator) -> tuple[dict[str, Any], dict[str, Any]]:
    """Every topic of the stage ``interact`` at 50 Hz; returns settings and metrics."""
    for time in np.arange(0.02, 4.0, 0.02):
        step = "come down" if time < 1 else "press" if time < 2 else "wipe"
        pressed = float(np.clip(time - 1, 0, 1))
        x, z = 0.1 * max(time - 2, 0.0), 1.02 + 0.1 * max(1 - time, 0.0)
        for child, place in (("tool", (x, 0.0, z)), ("reference", (x + 0.002 * pressed, 0.0, z - 0.001))):
            log.write(f"/interact/{child}", time, {"parent": "world", "child": child, "position_m": place})
        for body in BODIES[1:3]:
            frame = {"parent": "world", "child": body["name"], "position_m": body["position_m"]}
            log.write("/interact/body", time, frame)
        along = 20 * pressed + 0.2 * float(rng.standard_normal()) * (pressed > 0)
        contact = {"step": step, "body": "table" if pressed else "", "wanted_n": 20 * pressed}
        log.write("/interact/contact", time, contact | {"along_n": along, "across_n": 0.4 * along * (time > 2)})
        joints = {"names": ["a", "b"], "position_rad": [0.1, 0.2], "velocity_rad_s": [0.0, 0.0], "effort_nm": [z, x]}
        log.write("/interact/joints", time, joints)
        wrench = {f"{kind}_{axis}_{unit}": along for kind, unit in (("force", "n"), ("torque", "nm")) for axis in "xyz"}
        log.write("/interact/wrench", time, wrench)
    unturned = {"rotation_wxyz": [1.0, 0.0, 0.0, 0.0]}
    metrics = {"force_error_rms_n": 0.21, "contact_fraction": 1.0, "friction": 0.4, "touched": "table"}
    return {"scene": {"bodies": [body | unturned for body in BODIES]}, "interact": {"log_rate_hz": 50.0}}, metrics
