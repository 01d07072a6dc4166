"""A run's logs made up for tests: every topic, written through the real writer, plausible enough to look at."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

import numpy as np

from kendama_cli.report.page import make_report
from tests.log.made_logs import FieldLog
from tests.report.synthetic_interaction import write_interaction
from tests.report.synthetic_rehearsal import write_rehearsal
from tests.report.synthetic_robot import exchange_at, write_prediction, write_transfer
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


def write_run(folder: Path) -> tuple[dict[str, Any], dict[str, Path]]:
    """The logs in ``folder``; the run and stage -> log, as ``make_report`` takes them."""
    writers = {
        "capture": _capture,
        "encode": _encode,
        "identify": _identify,
        "adapt": _adapt,
        "learn": _learn,
        "predict": write_prediction,
        "transfer": write_transfer,
        "rehearse": write_rehearsal,
        "interact": write_interaction,
        "measure": _measure,
        "bench": _bench,
        "fit": _fit,
        "offline": _offline,
    }
    logs = {}
    for number, (name, write) in enumerate(writers.items()):
        log = FieldLog()
        settings, metrics = write(log, np.random.default_rng([7, number]))
        logs[name] = folder / f"{name}.mcap"
        log.finish(logs[name], stage=name, settings=settings, metrics=metrics)
    stages = [{"name": name, "status": "ran"} for name in writers]
    return {"run": "20260101-120000-abcd", "pipeline": "kendama", "overrides": ["seed=1"], "stages": stages}, logs


def _bench(log: FieldLog, rng: np.random.Generator) -> tuple[dict[str, Any], dict[str, Any]]:
    for index in range(60):
        total = float(5 * index + 20 * rng.standard_normal())
        message = {"index": index, "explored": index % 3 == 0, "total_reward": total, "steps": 10 + index}
        log.write("/bench/episode", float(index), message)
    return {"bench": {"environment": "CartPole-v1"}}, {"frozen_return": 280.0, "replayed_return": 40.0, "episodes": 60}


def _fit(log: FieldLog, rng: np.random.Generator) -> tuple[dict[str, Any], dict[str, Any]]:
    for t_s in np.arange(0.0, 2.0, 0.01).tolist():
        early = {"world": 0.0, "identified": 0.01, "network": 0.1, "wrong": 0.4}
        angles = {f"{name}_rad": float(np.sin(5.0 * t_s + one)) for name, one in early.items()}
        log.write("/fit/prediction", t_s, {"rollout": 0, **angles})
    return {"fit": {"string_m": 0.4}}, {"identified_error_mm": 1.0, "network_error_mm": 8.0, "wrong_error_mm": 30.0}


def _offline(log: FieldLog, rng: np.random.Generator) -> tuple[dict[str, Any], dict[str, Any]]:
    write_rollouts(log, "/offline/rollout", rng, 60)
    for world in (False, True):
        for t_s in np.arange(0.0, 2.0, 0.01).tolist():
            angle = t_s * np.sin(5.0 * t_s) + 0.02 * world
            ball = {"ball_x_m": 0.4 * float(np.sin(angle)), "ball_z_m": -0.4 * float(np.cos(angle))}
            log.write("/offline/swing", t_s, {"world": world, "cup_m": 0.0, **ball})
    return {"offline": {"model": "identified"}}, {"world_caught_rate": 0.98, "model_caught_rate": 1.0}


def _capture(log: FieldLog, rng: np.random.Generator) -> tuple[dict[str, Any], dict[str, Any]]:
    t = np.arange(0, 2.5, 0.01)
    for number in range(10):
        stretch = 1 + 0.04 * rng.standard_normal()
        cup = (1 + 0.08 * rng.standard_normal()) * played_swing(t / stretch)[0]
        write_frames(log, "/capture/cup", f"swing-{number:02d}", t, cup)
    metrics = {"n_demonstrations": 10, "sample_rate_hz": 100.0, "duration_s": 2.5, "peak_speed_m_s": 1.234}
    return {"settings": {"kind": "file", "path": ["data/a.csv"], "rate_hz": 100.0}}, metrics


def _measure(log: FieldLog, rng: np.random.Generator) -> tuple[dict[str, Any], dict[str, Any]]:
    for t_s in np.arange(0, 10, 0.05).tolist():
        angle = np.exp(-0.05 * t_s) * np.cos(5.0 * t_s)
        fitted, seen = 0.4 * np.array([np.sin(angle), -np.cos(angle)]), rng.normal(0.0, 1e-3, 2)
        x, z = (fitted + seen).tolist()
        fields = {"x_m": x, "z_m": z, "fitted_x_m": float(fitted[0]), "fitted_z_m": float(fitted[1])}
        log.write("/measure/swing", t_s, fields)
        log.write("/measure/exchange", t_s, exchange_at(t_s))
    return {"settings": {"rope_m": 0.4}, "game": GAME}, {"rope_m": 0.4, "fit_rms_mm": 1.4}


def _encode(log: FieldLog, rng: np.random.Generator) -> tuple[dict[str, Any], dict[str, Any]]:
    t = np.arange(0, 2.5, 0.01)
    for number in range(10):
        name, cup = f"swing-{number:02d}", (1 + 0.08 * rng.standard_normal()) * played_swing(t)[0]
        write_frames(log, "/encode/demonstrated", name, t, cup)
        write_frames(log, "/encode/own", name, t, cup + 1e-3 * np.sin(9 * t)[:, None])
        _weights(log, name, 40 * rng.standard_normal(20))
    write_frames(log, "/encode/reproduced", "reproduced", t, played_swing(t)[0])
    _weights(log, "reproduced", np.zeros(20))
    return {"settings": {"functions": 20}}, {"n_parameters": 22, "rmse_mm": 0.334, "max_error_mm": 0.77}


def _weights(log: FieldLog, name: str, extra: np.ndarray) -> None:
    for axis in "xyz":
        values = 300 * np.sin(np.arange(20) / 2 + ord(axis)) + extra
        message = {"demonstration": name, "coordinate": axis, "centers": np.exp(-np.arange(20) / 19), "values": values}
        log.write("/encode/weights", 0.0, message)


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
    log.write("/identify/servo", 0.0, SERVO)
    circle = 0.15 * np.column_stack([np.sin(2 * t), 1 - np.cos(2 * t)])
    write_frames(log, "/identify/tracking/reference", "cup", t, circle)
    write_frames(log, "/identify/tracking/before", "cup", t, circle + 4e-3 * np.sign(np.cos(2 * t))[:, None])
    write_frames(log, "/identify/tracking/after", "cup", t, circle + 3e-4 * rng.standard_normal((len(t), 2)))
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
    "joint_friction_fraction",
    "lag_s",
    "cup_error_m",
    "cup_error_hz",
    "cup_error_phase_rad",
)


def _adapt(log: FieldLog, rng: np.random.Generator) -> tuple[dict[str, Any], dict[str, Any]]:
    for index, tau in enumerate(np.concatenate([np.linspace(0.84, 1.16, 17), [1.035, 1.045]])):
        miss = 0.9 * np.sin(12 * (tau - 0.895)) * (tau - 1.04) * 8
        message = {"index": index, "tau_scale": tau, "signed_miss_m": miss, "caught": abs(miss) < 0.025}
        log.write("/adapt/rollout", 2.5 * index, {**message, "amplitude": 1.0, "shift_x_m": 0.0, "shift_y_m": 0.0})
    for index, (low, high) in enumerate([(0.885, 0.905), (1.033, 1.047)]):
        middle = (low + high) / 2
        fields = {"index": index, "low": low, "high": high, "middle": middle, "swing_slack_s": 0.03 * index}
        log.write("/adapt/window", 40.0, fields)
        for world in range(4):
            message = {"index": world, "tau_scale": middle, "signed_miss_m": 0.01 * (world - 1.5), "caught": True}
            log.write("/adapt/candidate", 41.0, {**message, "amplitude": 1.0, "shift_x_m": 0.0, "shift_y_m": 0.0})
    for index in range(12):
        bent = {"cost_m": 0.3 / (1 + index), "miss_m": 0.3 / (1 + index), "caught": index > 8, "bumps_m": [0.01] * 8}
        moved = {"tau_scale": 1.0, "shift_x_m": 0.01, "shift_y_m": 0.0}
        log.write(
            "/adapt/explored", 45.0, {"index": index, "generation": index // 6, "swing_slack_s": 0.0, **bent, **moved}
        )
        proof = {"rollouts": 6 * (1 + index // 6), "index": index % 6, "caught": index > 4, "miss_m": 0.01}
        log.write("/adapt/evaluation", 46.0, proof)
    for index in range(30):
        miss = 0.02 * rng.standard_normal()
        caught = bool(abs(miss) < 0.03)
        log.write("/adapt/repeat", 50 + index, {"index": index, "caught": caught, "miss_m": miss})
        log.write("/adapt/replay", 50 + index, replay_message(index, caught, miss))
        log.write("/adapt/perturbation", 50 + index, {"index": index} | dict.fromkeys(DRAWN, 1.0))
    t = np.arange(0, 2.5, 0.004)
    cup, ball = played_swing(t)
    write_frames(log, "/adapt/cup", "cup", t, cup)
    write_frames(log, "/adapt/ball", "ball", t, ball)
    write_arm(log, "/adapt/scene", "/adapt", t, cup)
    write_frames(log, "/adapt/reference", "reference", t, cup + 4e-4 * np.sin(8 * t)[:, None])
    names = [f"joint_{n}" for n in range(1, 8)]
    for time in t[::2]:
        q = np.sin(time * np.arange(1, 8))
        message = {"names": names, "position_rad": q, "velocity_rad_s": np.cos(time * np.arange(1, 8)), "effort_nm": q}
        log.write("/adapt/joints", time, message)
    metrics = {"caught": True, "tau_scale": 1.0401, "rollouts": 19, "success_rate": 0.8, "amplitude": 1.0}
    metrics |= {"success_rate_low": 0.614, "success_rate_high": 0.923, "windows": 2}
    return {"settings": {"repeats": 30}, "game": GAME, "robot": {"kind": "dart"}}, metrics


def _learn(log: FieldLog, rng: np.random.Generator) -> tuple[dict[str, Any], dict[str, Any]]:
    write_rollouts(log, "/learn/rollout", rng, 60)
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
    cup, ball = played_swing(t)
    write_frames(log, "/learn/cup", "cup", t, cup * [1, 0])
    write_frames(log, "/learn/ball", "ball", t, ball - cup * [0, 1])
    for time in t:
        log.write("/learn/step", time, {**state_at(time), "tension_n": 0.5})
    metrics = {
        "learned": True,
        "rollouts_to_learned": 38,
        "rollouts_to_solved": 41,
        "frozen_visual_caught_rate": 0.93,
        "frozen_caught_rate": 0.94,
        "half_swings": 2.0,
    }
    return {
        "settings": {"grid": grid, "actions_m_s2": [-8.0, -4.0, 0.0, 4.0, 8.0], "alpha": 0.7},
        "game": GAME,
    }, metrics


if __name__ == "__main__":  # a process of its own: the report of the logs in argv[1]
    FOLDER = Path(sys.argv[1])
    RUN = json.loads((FOLDER / "run.json").read_text())
    sys.stdout.write(make_report(RUN, {stage["name"]: FOLDER / f"{stage['name']}.mcap" for stage in RUN["stages"]}))
