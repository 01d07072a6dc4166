"""A run's logs made up for tests: every topic, written through the real writer, plausible enough to look at."""

from __future__ import annotations

import io
import json
import sys
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image, ImageDraw

from kendama_cli.report.page import make_report
from tests.log.made_logs import FieldLog
from tests.report.synthetic_interaction import write_interaction
from tests.report.synthetic_rehearsal import write_rehearsal

GAME = {
    "gravity_m_s2": 9.81,
    "rope": {"length_m": 0.4, "stiffness_n_m": 2000.0, "damping_n_s_m": 2.0},
    "ball": {"mass_kg": 0.05, "radius_m": 0.02},
    "cup": {"radius_m": 0.045, "depth_m": 0.07, "staves": 12},
}
ROPE_M = 0.4


def write_run(folder: Path) -> tuple[dict[str, Any], dict[str, Path]]:
    """The logs in ``folder``; the run and stage -> log, as ``make_report`` takes them."""
    writers = {
        "capture": _capture,
        "encode": _encode,
        "identify": _identify,
        "adapt": _adapt,
        "learn": _learn,
        "predict": _predict,
        "transfer": _transfer,
        "rehearse": write_rehearsal,
        "interact": write_interaction,
    }
    logs = {}
    for number, (name, write) in enumerate(writers.items()):
        log = FieldLog()
        settings, metrics = write(log, np.random.default_rng([7, number]))
        logs[name] = folder / f"{name}.mcap"
        log.finish(logs[name], stage=name, settings=settings, metrics=metrics)
    stages = [{"name": name, "status": "ran"} for name in writers]
    return {"run": "20260101-120000-abcd", "pipeline": "kendama", "overrides": ["seed=1"], "stages": stages}, logs


def _swing(t: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Cup and ball (n, 2) in x and z: a growing swing, a flight from 1.5 s to 1.9 s, rest in the cup."""
    window = np.clip(t / 0.4, 0, 1) * np.clip((1.9 - t) / 0.4, 0, 1)
    cup = np.column_stack([0.16 * window * np.sin(4 * t), 0.08 * window * np.sin(5 * t + 1)])
    phi = 2.3 * np.clip(t / 1.5, 0, 1) ** 2 * np.sin(5.2 * t - 1.2)
    ball = cup + ROPE_M * np.column_stack([np.sin(phi), -np.cos(phi)])
    release, catch = np.searchsorted(t, [1.5, 1.9])
    goal = np.array([0.0, 0.07])
    flight = t[release:catch] - t[release]
    duration = 0.4
    velocity = (goal - ball[release] - [0, -0.5 * 9.81 * duration**2]) / duration
    path = ball[release] + velocity * flight[:, None] - [0, 1] * (0.5 * 9.81 * flight**2)[:, None]
    ball[release:catch] = path
    cup[release:] = cup[release] * np.clip(1 - (t[release:, None] - t[release]) / 0.3, 0, 1)
    ball[catch:] = cup[catch:] + np.array([0.0, 0.026])
    return cup, ball


def _frames(log: FieldLog, topic: str, child: str, t: np.ndarray, points: np.ndarray) -> None:
    for time, (x, z) in zip(t, points, strict=True):
        half = 0.15 * np.sin(4 * time) / 2 if child == "cup" else 0.0
        rotation = (np.cos(half), 0.0, np.sin(half), 0.0)
        position = (0.5 + x, 0.02, 1.0 + z)
        log.write(topic, time, {"parent": "world", "child": child, "position_m": position, "rotation_wxyz": rotation})


def _capture(log: FieldLog, rng: np.random.Generator) -> tuple[dict[str, Any], dict[str, Any]]:
    t = np.arange(0, 2.5, 0.01)
    for number in range(10):
        stretch = 1 + 0.04 * rng.standard_normal()
        cup = (1 + 0.08 * rng.standard_normal()) * _swing(t / stretch)[0]
        _frames(log, "/capture/cup", f"swing-{number:02d}", t, cup)
    metrics = {"n_demonstrations": 10, "sample_rate_hz": 100.0, "duration_s": 2.5, "peak_speed_m_s": 1.234}
    return {"settings": {"kind": "file", "path": ["data/a.csv"], "rate_hz": 100.0}}, metrics


def _encode(log: FieldLog, rng: np.random.Generator) -> tuple[dict[str, Any], dict[str, Any]]:
    t = np.arange(0, 2.5, 0.01)
    for number in range(10):
        name, cup = f"swing-{number:02d}", (1 + 0.08 * rng.standard_normal()) * _swing(t)[0]
        _frames(log, "/encode/demonstrated", name, t, cup)
        _frames(log, "/encode/own", name, t, cup + 1e-3 * np.sin(9 * t)[:, None])
        _weights(log, name, 40 * rng.standard_normal(20))
    _frames(log, "/encode/reproduced", "reproduced", t, _swing(t)[0])
    _weights(log, "reproduced", np.zeros(20))
    return {"settings": {"functions": 20}}, {"n_parameters": 22, "rmse_mm": 0.334, "max_error_mm": 0.77}


def _weights(log: FieldLog, name: str, extra: np.ndarray) -> None:
    for axis in "xyz":
        values = 300 * np.sin(np.arange(20) / 2 + ord(axis)) + extra
        message = {"demonstration": name, "coordinate": axis, "centers": np.exp(-np.arange(20) / 19), "values": values}
        log.write("/encode/weights", 0.0, message)


WRENCH = {f"{kind}_{axis}_{unit}": 0.5 for kind, unit in (("force", "n"), ("torque", "nm")) for axis in "xyz"}


def _identify(log: FieldLog, rng: np.random.Generator) -> tuple[dict[str, Any], dict[str, Any]]:
    t = np.arange(0, 4.0, 0.02)
    names = ["shoulder", "elbow"]
    for time in t:
        for joint in names:
            v = 2.0 * np.sin(3 * time + len(joint))
            model = 0.5 * np.sign(v) + 0.1 * v
            fits = {"parametric_nm": model, "network_nm": 1.02 * model}
            seen = {"joint": joint, "velocity_rad_s": v, "friction_nm": model + 0.05 * rng.standard_normal()}
            log.write("/identify/friction", time, seen | fits)
        joints = {"names": names, "position_rad": [0.1, 0.2], "velocity_rad_s": [0.0, 0.0], "effort_nm": [1.0, 2.0]}
        log.write("/identify/joints", time, joints)
        log.write("/identify/wrench", time, WRENCH)
    circle = 0.15 * np.column_stack([np.sin(2 * t), 1 - np.cos(2 * t)])
    _frames(log, "/identify/tracking/reference", "cup", t, circle)
    _frames(log, "/identify/tracking/before", "cup", t, circle + 4e-3 * np.sign(np.cos(2 * t))[:, None])
    _frames(log, "/identify/tracking/after", "cup", t, circle + 3e-4 * rng.standard_normal((len(t), 2)))
    metrics = {
        "model": "parametric",
        "tracking_rms_mm_before": 5.7,
        "tracking_rms_mm_after": 0.42,
        "tracking_speed_m_s": 1.0,
        "drive_delay_ms": 0.0,
    }
    return {"identify": {"harmonics": 3}, "game": GAME}, metrics


DRAWN = (
    "rope_scale",
    "ball_start_m",
    "mass_scale",
    "drag_scale",
    "restitution",
    "joint_friction_nm",
    "joint_friction_share",
    "lag_s",
    "cup_error_m",
    "cup_error_hz",
    "cup_error_phase_rad",
)


def _replay(index: int, caught: bool, miss_m: float) -> dict[str, Any]:
    body = {"rope_m": 0.4, "ball_kg": 0.05, "drag_n_s_m": 1e-4, "drag_n_s2_m2": 4e-4, "restitution": 0.2}
    way = {"t_s": [0.0, 0.01], "cup_m": [0.0] * 6, "cup_axis": [0.0, 0.0, 1.0] * 2, "ball_m": [0.0, 0.0, -0.4] * 2}
    return {"index": index, "since_s": 0.0, "caught": caught, "miss_m": miss_m, **body, **way}


def _adapt(log: FieldLog, rng: np.random.Generator) -> tuple[dict[str, Any], dict[str, Any]]:
    for index, tau in enumerate(np.concatenate([np.linspace(0.84, 1.16, 17), [1.035, 1.045]])):
        miss = 0.9 * np.sin(12 * (tau - 0.895)) * (tau - 1.04) * 8
        message = {"index": index, "tau_scale": tau, "signed_miss_m": miss, "caught": abs(miss) < 0.025}
        log.write("/adapt/rollout", 2.5 * index, {**message, "amplitude": 1.0, "shift_x_m": 0.0, "shift_y_m": 0.0})
    for index, (low, high) in enumerate([(0.885, 0.905), (1.033, 1.047)]):
        middle = (low + high) / 2
        fields = {"index": index, "low": low, "high": high, "middle": middle, "swing_slack_s": 0.03 * index}
        log.write("/adapt/window", 40.0, fields)
        for corner in range(4):
            message = {"index": corner, "tau_scale": middle, "signed_miss_m": 0.01 * (corner - 1.5), "caught": True}
            log.write("/adapt/corner", 41.0, {**message, "amplitude": 1.0, "shift_x_m": 0.0, "shift_y_m": 0.0})
    for index in range(30):
        miss = 0.02 * rng.standard_normal()
        caught = bool(abs(miss) < 0.03)
        log.write("/adapt/repeat", 50 + index, {"index": index, "caught": caught, "miss_m": miss})
        log.write("/adapt/replay", 50 + index, _replay(index, caught, miss))
        log.write("/adapt/drawn", 50 + index, {"index": index} | dict.fromkeys(DRAWN, 1.0))
    t = np.arange(0, 2.5, 0.004)
    cup, ball = _swing(t)
    _frames(log, "/adapt/cup", "cup", t, cup)
    _frames(log, "/adapt/ball", "ball", t, ball)
    _frames(log, "/adapt/reference", "reference", t, cup + 4e-4 * np.sin(8 * t)[:, None])
    names = [f"joint_{n}" for n in range(1, 8)]
    for time in t[::2]:
        q = np.sin(time * np.arange(1, 8))
        message = {"names": names, "position_rad": q, "velocity_rad_s": np.cos(time * np.arange(1, 8)), "effort_nm": q}
        log.write("/adapt/joints", time, message)
    metrics = {"caught": True, "tau_scale": 1.0401, "rollouts": 19, "success_rate": 0.8, "amplitude": 1.0}
    metrics |= {"success_rate_low": 0.614, "success_rate_high": 0.923, "windows": 2}
    return {"settings": {"repeats": 30}, "game": GAME, "robot": {"kind": "dart"}}, metrics


def _learn(log: FieldLog, rng: np.random.Generator) -> tuple[dict[str, Any], dict[str, Any]]:
    _rollouts(log, "/learn/rollout", rng, 60)
    grid = {
        "position": "distance",
        "position_edges_m": [0.15],
        "velocity_edges_m_s": [-0.7, 0.7],
        "angle_bins": 18,
        "rate_edges_rad_s": [-0.5, 0.5],
    }
    q = rng.normal(5, 20, (324, 5))
    q[rng.random(324) < 0.3] = 5.0
    for rollout in (0, 30, 60):
        message = {
            "rollout": rollout,
            "rows": 324,
            "columns": 5,
            "values": q.ravel() if rollout else np.full(1620, 5.0),
        }
        log.write("/learn/table", 4.0 * rollout, message)
    t = np.arange(0, 1.6, 0.004)
    cup, ball = _swing(t)
    _frames(log, "/learn/cup", "cup", t, cup * [1, 0])
    _frames(log, "/learn/ball", "ball", t, ball - cup * [0, 1])
    for time in t:
        log.write("/learn/step", time, {**_state(time), "tension_n": 0.5})
    metrics = {"learned": True, "rollouts_to_learn": 38, "frozen_success_rate": 0.94, "swings": 2.0}
    return {
        "settings": {"grid": grid, "actions_m_s2": [-8.0, -4.0, 0.0, 4.0, 8.0], "alpha": 0.7},
        "game": GAME,
    }, metrics


def _state(time: float) -> dict[str, float]:
    return {
        "x_m": 0.16 * np.sin(4 * time),
        "velocity_m_s": 0.64 * np.cos(4 * time),
        "angle_rad": 2.3 * (time / 1.5) ** 2 * np.sin(5.2 * time - 1.2),
        "rate_rad_s": 1.0,
        "action_m_s2": float(4 * np.round(2 * np.sin(7 * time))),
    }


def _rollouts(log: FieldLog, topic: str, rng: np.random.Generator, n: int) -> None:
    for index in range(n):
        explored = bool(rng.random() < 0.6 * np.exp(-index / 15))
        success = bool(rng.random() < 1 - np.exp(-index / 12))
        message = {
            "index": index,
            "explored": explored,
            "reward": (100.0 if success else -5.0) - 10 * rng.random(),
            "success": success,
            "duration_s": 1.6,
            "peak_displacement_m": 0.3,
            "half_swings": 4,
        }
        log.write(topic, 4.0 * index, message)


def _predict(log: FieldLog, rng: np.random.Generator) -> tuple[dict[str, Any], dict[str, Any]]:
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
    _frames(log, "/predict/ball", "ball", np.arange(0, 0.33, 0.01), np.zeros((33, 2)))
    for flight in range(40):
        for horizon in range(20, 301, 20):
            error = abs(rng.normal(0, 0.5 + horizon / 60))
            message = {"horizon_ms": horizon, "position_error_mm": error, "time_error_ms": error / 4}
            log.write("/predict/error", 10.0 + flight, {"flight": flight, **message})
    metrics = {
        "position_error_mm_p50": 2.1,
        "position_error_mm_p95": 7.9,
        "time_error_ms_p50": 0.4,
        "horizon_ms": 150.0,
    }
    return {"settings": {"flights": 40}, "game": GAME}, metrics


def _transfer(log: FieldLog, rng: np.random.Generator) -> tuple[dict[str, Any], dict[str, Any]]:
    _rollouts(log, "/transfer/rollout", rng, 25)
    _rollouts(log, "/transfer/scratch/rollout", rng, 40)
    t = np.arange(0, 2.5, 0.01)
    cup, ball = _swing(t)
    for attempt in range(2):
        start_s = 100 + 2.5 * attempt
        _frames(log, "/transfer/imitation/cup", "cup", start_s + t, cup)
        _frames(log, "/transfer/imitation/ball", "ball", start_s + t, ball)
        log.write("/transfer/imitation/wrench", start_s, WRENCH)
    for index in range(6):
        start_s = 105 + 2.5 * index
        _frames(log, "/transfer/cup", "cup", start_s + t, cup)
        _frames(log, "/transfer/ball", "ball", start_s + t, ball)
        for time in t:
            joints = {"names": ["a"], "position_rad": [0.1], "velocity_rad_s": [0.0], "effort_nm": [0.0]}
            log.write("/transfer/step", start_s + time, {"rollout": -1 - index, **_state(min(time, 1.5))})
            log.write("/transfer/joints", start_s + time, joints)
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
        log.write("/transfer/replay", start_s + 2.5, _replay(index, True, 0.004))
    picture = io.BytesIO()
    Image.new("RGB", (640, 480), (206, 204, 198)).save(picture, "jpeg", quality=80)
    log.write("/transfer/image/left", 106.6, {"frame": "left", "format": "jpeg", "data": picture.getvalue()})
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


if __name__ == "__main__":  # a process of its own: the report of the logs in argv[1]
    FOLDER = Path(sys.argv[1])
    RUN = json.loads((FOLDER / "run.json").read_text())
    sys.stdout.write(make_report(RUN, {stage["name"]: FOLDER / f"{stage['name']}.mcap" for stage in RUN["stages"]}))
