"""Messages that several made-up stages log: a swing, its rollouts, what a referee plays again."""

from __future__ import annotations

from typing import Any

import numpy as np

from kendama_cli.schema.foxglove import Solid
from tests.log.made_logs import FieldLog
from tests.shipped_conf import plain

GAME = {
    "gravity_m_s2": 9.81,
    "rope": {"length_m": 0.4, "stiffness_n_m": 2000.0, "damping_n_s_m": 2.0},
    "ball": {"mass_kg": 0.05, "radius_m": 0.02},
    "cup": plain("game", "kendama")["cup"],
}
ROPE_M = 0.4


def played_swing(t: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
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


def write_frames(log: FieldLog, topic: str, child: str, t: np.ndarray, points: np.ndarray) -> None:
    for time, (x, z) in zip(t, points, strict=True):
        half = 0.15 * np.sin(4 * time) / 2 if child == "cup" else 0.0
        rotation = (np.cos(half), 0.0, np.sin(half), 0.0)
        position = (0.5 + x, 0.02, 1.0 + z)
        log.write(topic, time, {"parent": "world", "child": child, "position_m": position, "rotation_wxyz": rotation})


def write_arm(log: FieldLog, scene: str, under: str, t: np.ndarray, points: np.ndarray) -> None:
    """An arm of one link on a post, whose link points from the shoulder to the cup; looks under ``scene``."""
    shoulder = np.array([0.5, -0.5, 1.1])
    grey, upright = (0.8, 0.8, 0.82), (1.0, 0.0, 0.0, 0.0)
    solids = (
        Solid("post", "pedestal", "cylinder", grey, (0.2, 0.2, 1.1), (0.0, 0.0, 0.55)),
        Solid("link", "link", "cylinder", grey, (0.12, 0.12, 0.48), (0.0, 0.0, 0.24), top_scale=0.7),
        Solid("link", "joint", "box", (0.2, 0.2, 0.25), (0.2, 0.2, 0.2)),
        Solid("cup", "cup", "mesh", grey, vertices_m=CORNERS, triangles=((0, 1, 2), (0, 2, 3), (0, 3, 1), (1, 3, 2))),
        Solid("ball", "ball", "sphere", (0.8, 0.4, 0.0), (0.04, 0.04, 0.04)),
    )
    log.write(scene, float(t[0]), {"solids": solids})
    for time, (x, z) in zip(t[::5], points[::5], strict=True):
        way = np.array([0.5 + x, 0.02, 1.0 + z]) - shoulder
        way /= np.linalg.norm(way)
        turn = np.array([1 + way[2], *np.cross([0.0, 0.0, 1.0], way)])  # the shortest turn of z to the way
        turns = (upright, turn / np.linalg.norm(turn))
        poses = {"positions_m": ((0.5, -0.5, 0.0), shoulder), "rotations_wxyz": turns}
        log.write(f"{under}/links", time, {"parent": "world", "children": ("post", "link"), **poses})


CORNERS = ((0.05, 0.0, 0.0), (-0.03, 0.04, 0.0), (-0.03, -0.04, 0.0), (0.0, 0.0, 0.07))
"""Of a made-up cup: what is drawn is what was logged."""

SERVO = {"joints": ["shoulder"], "dead_time_s": 0.004, "lag_s": [0.1], "lag_sigma_s": [0.001]}
SERVO |= {"sag_rad_nm": [5e-4], "offset_rad": [1e-3]}
WRENCH = {f"{kind}_{axis}_{unit}": 0.5 for kind, unit in (("force", "n"), ("torque", "nm")) for axis in "xyz"}


def replay_message(index: int, caught: bool, miss_m: float) -> dict[str, Any]:
    body = {"rope_m": 0.4, "rope_kg": 0.0, "ball_kg": 0.05}
    body |= {"drag_n_s_m": 1e-4, "drag_n_s2_m2": 4e-4, "restitution": 0.2}
    way = {"t_s": [0.0, 0.01], "cup_m": [0.0] * 6, "cup_axis": [0.0, 0.0, 1.0] * 2, "ball_m": [0.0, 0.0, -0.4] * 2}
    return {"index": index, "since_s": 0.0, "caught": caught, "miss_m": miss_m, **body, **way}


def state_at(time: float) -> dict[str, float]:
    return {
        "x_m": 0.16 * np.sin(4 * time),
        "velocity_m_s": 0.64 * np.cos(4 * time),
        "angle_rad": 2.3 * (time / 1.5) ** 2 * np.sin(5.2 * time - 1.2),
        "rate_rad_s": 1.0,
        "action_m_s2": float(4 * np.round(2 * np.sin(7 * time))),
    }


def write_rollouts(log: FieldLog, topic: str, rng: np.random.Generator, n: int) -> None:
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
