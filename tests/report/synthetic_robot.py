"""Made-up logs of the stages predict and transfer."""

from __future__ import annotations

import io
from typing import Any

import numpy as np
from PIL import Image, ImageDraw

from tests.log.made_logs import FieldLog
from tests.report.synthetic_swing import (
    GAME,
    SERVO,
    WRENCH,
    played_swing,
    replay_message,
    state_at,
    write_arm,
    write_frames,
    write_rollouts,
)


def write_prediction(log: FieldLog, rng: np.random.Generator) -> tuple[dict[str, Any], dict[str, Any]]:
    for step in range(12):
        time = step / 60
        u, v = 120.0 + 30 * step, 300.0 - 60 * step + 4.5 * step**2
        picture = Image.new("RGB", (640, 480), (206, 204, 198))
        pen = ImageDraw.Draw(picture)
        pen.rectangle((0, 400, 640, 480), fill=(120, 116, 108))
        pen.ellipse((u - 14, v - 14, u + 14, v + 14), fill=(214, 90, 40))
        data = io.BytesIO()
        picture.save(data, "jpeg", quality=80)
        log.write("/predict/image/left", time, {"frame": "left", "format": "jpeg", "data": data.getvalue()})
        found = {"flight": 0, "camera": "left", "u_px": u, "v_px": v, "radius_px": 14.0, "seen": True}
        log.write("/predict/detection", time, found)
        estimate = dict.fromkeys(("sigma_t_s", "sigma_x_m", "sigma_y_m", "sigma_z_m"), 0.1 * 0.6**step)
        estimate |= {f"velocity_{axis}_m_s": -1.0 for axis in "xyz"}
        estimate |= {f"{axis}_m": 0.1 + 0.08 * 0.6**step * rng.standard_normal() for axis in "xyz"}
        log.write("/predict/estimate", time, {"flight": 0, "t_catch_s": 0.32, **estimate})
    write_frames(log, "/predict/ball", "ball", np.arange(0, 0.33, 0.01), np.zeros((33, 2)))
    for flight in range(40):
        for horizon in range(20, 301, 20):
            error = abs(rng.normal(0, 0.5 + horizon / 60))
            message = {"horizon_ms": horizon, "position_error_mm": error, "time_error_ms": error / 4}
            log.write("/predict/error", 10.0 + flight, {"flight": flight, **message})
    metrics = {
        "position_error_mm_p50": 2.1,
        "position_error_mm_p95": 7.9,
        "time_error_ms_p50": 0.4,
        "prediction_horizon_ms": 150.0,
    }
    return {"settings": {"flights": 40}, "game": GAME}, metrics


def exchange_at(t_s: float) -> dict[str, Any]:
    """One joint that follows what it is sent 20 ms late."""
    sent, measured = (0.3 * np.sin(3.0 * (t_s - late)) for late in (0.0, 0.02))
    exchange = {"joints": ["a"], "sent_rad": [sent], "sent_rad_s": [0.0], "sent_nm": [0.0]}
    return exchange | {"measured_rad": [measured], "measured_rad_s": [0.0], "measured_nm": [1.0]}


def write_transfer(log: FieldLog, rng: np.random.Generator) -> tuple[dict[str, Any], dict[str, Any]]:
    write_rollouts(log, "/transfer/rollout", rng, 25)
    write_rollouts(log, "/transfer/scratch/rollout", rng, 40)
    log.write("/transfer/servo", 0.0, SERVO)
    t = np.arange(0, 2.5, 0.01)
    cup, ball = played_swing(t)
    for number in range(2):
        start_s = 100 + 2.5 * number
        write_frames(log, "/transfer/imitation/cup", "cup", start_s + t, cup)
        write_frames(log, "/transfer/imitation/ball", "ball", start_s + t, ball)
        log.write("/transfer/imitation/wrench", start_s, WRENCH)
        attempt = {"index": number, "along_m": 0.0, "shift_x_m": 0.01, "shift_y_m": 0.0, "caught": number == 1}
        came_down = {
            "miss_x_m": -0.03,
            "miss_y_m": 0.002,
            "apex_m": 0.2,
            "led": True,
            "outcome": "",
            "path_m": [-0.2, 0.2],
            "bent": [],
        }
        log.write("/transfer/imitation/rollout", start_s, attempt | came_down)
        write_arm(log, "/transfer/scene", "/transfer/imitation", start_s + t, cup)
    for index in range(6):
        start_s = 105 + 2.5 * index
        write_frames(log, "/transfer/cup", "cup", start_s + t, cup)
        write_frames(log, "/transfer/ball", "ball", start_s + t, ball)
        write_arm(log, "/transfer/scene", "/transfer", start_s + t, cup)
        for time in t:
            joints = {"names": ["a"], "position_rad": [0.1], "velocity_rad_s": [0.0], "effort_nm": [0.0]}
            log.write("/transfer/step", start_s + time, {"rollout": -1 - index, **state_at(min(time, 1.5))})
            log.write("/transfer/joints", start_s + time, joints)
            log.write("/transfer/exchange", start_s + time, exchange_at(time))
            log.write("/transfer/wrench", start_s + time, WRENCH)
        swung = bool(index != 2)
        for step in range(12 if swung else 0):
            spread = 0.02 * 0.6**step
            estimate = {"game": index, "t_catch_s": start_s + 1.9, "sigma_t_s": spread / 3}
            estimate |= {"x_m": 0.05 + spread * rng.normal(), "y_m": 0.0, "z_m": 0.09}
            estimate |= {"velocity_x_m_s": 0.3, "velocity_y_m_s": 0.0, "velocity_z_m_s": -2.0}
            estimate |= {"covariance_m2": (spread**2 * np.eye(3)).ravel()}
            log.write("/transfer/estimate", start_s + 1.6 + 0.02 * step, estimate)
            seen = {"flight": index, "camera": "left", "u_px": 300.0 + step, "v_px": 200.0, "radius_px": 8.0}
            log.write("/transfer/detection", start_s + 1.6 + 0.02 * step, seen | {"seen": True})
        caught = bool(swung and index < 5)
        game = {"index": index, "swung_up": swung, "predicted": swung, "caught": caught, "frames": 24, "seen": 24}
        game |= {"outcome": "caught" if caught else "passed by", "since_s": start_s + 1.95, "free_s": start_s + 1.55}
        game |= {
            "latency_frames": 0.9,
            "blow_n": 3.0,
            "crossing_s": start_s + 1.9,
            "crossing_m": [0.05, 0.0, 0.09],
            "prediction_error_mm": abs(rng.normal(0, 6)),
        }
        log.write("/transfer/game", start_s + 2.5, game)
        log.write("/transfer/replay", start_s + 2.5, replay_message(index, True, 0.004))
    picture = io.BytesIO()
    Image.new("RGB", (640, 480), (206, 204, 198)).save(picture, "jpeg", quality=80)
    for time in (106.6, 106.75):  # the second one a moment at which the ball was not found
        log.write("/transfer/image/left", time, {"frame": "left", "format": "jpeg", "data": picture.getvalue()})
    metrics = {
        "rollouts": 25,
        "success_rate_before": 0.7,
        "success_rate_after": 0.95,
        "imitation_caught": True,
        "games": 6,
        "caught_rate": 0.667,
        "missed_packets": 0,
    }
    return {"hardware": {"kind": "twin", "realtime": False}, "game": GAME}, metrics
