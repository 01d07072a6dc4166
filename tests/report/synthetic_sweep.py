"""The logs of several runs made up for tests: two explorations over many seeds, and nine bodies to transfer to."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

import numpy as np

from kendama_cli.report.ensemble import Run
from kendama_cli.report.sweep_page import make_sweep_report
from tests.log.made_logs import FieldLog

CAP = 1000
TWINS = {
    "twin_rope_short": {"rope_scale": 0.9},
    "twin_rope_long": {"rope_scale": 1.1},
    "twin_lag_40": {"lag_s": 0.04},
    "twin_noise_3": {"ball_noise_m": 0.0015},
}


def write_explorations(folder: Path, seeds: int = 20) -> list[Run]:
    """``learn`` by SARSA and epsilon-greedy; seed 3 of the latter stays unsolved."""
    runs: list[Run] = []
    for number, (kind, mean) in enumerate((("sarsa", 12.0), ("epsilon_greedy", 60.0))):
        for seed in range(seeds):
            rng = np.random.default_rng([number, seed])
            learned = not (kind == "epsilon_greedy" and seed == 3)
            needed = int(rng.geometric(1 / mean)) if learned else CAP
            path = folder / f"learn-{kind}-{seed}.mcap"
            _learn(path, rng, needed, learned)
            overrides = [f"learn/learner={kind}", f"seed={seed}"]
            runs.append((_document(overrides, "learn"), {"learn": path}))
    return runs


def write_transfers(folder: Path, seeds: int = 3) -> list[Run]:
    """Four twins; the log of ``learn`` is shared by all runs of a seed, and the last run failed in ``transfer``."""
    runs: list[Run] = []
    for seed in range(seeds):
        rng = np.random.default_rng([9, seed])
        learn = folder / f"learn-{seed}.mcap"
        _learn(learn, rng, 10 + seed, learned=True)
        for twin, body in TWINS.items():
            path = folder / f"transfer-{twin}-{seed}.mcap"
            _transfer(path, body, given=1 + seed, scratch=10 + 5 * seed)
            overrides = [f"hardware={twin}", f"seed={seed}"]
            runs.append((_document(overrides, "learn", "transfer"), {"learn": learn, "transfer": path}))
    document = _document(["hardware=twin_lag_40", f"seed={seeds}"], "learn", "transfer")
    document["stages"][1] |= {"status": "failed", "error": "the line is <cut>"}
    return [*runs, (document, {"learn": folder / f"learn-{seeds - 1}.mcap"})]


def _document(overrides: list[str], *stages: str) -> dict[str, Any]:
    entries = [{"name": stage, "status": "ran"} for stage in stages]
    return {"run": "20260101-120000-abcd", "pipeline": "swingup", "overrides": overrides, "stages": entries}


def _learn(path: Path, rng: np.random.Generator, needed: int, learned: bool) -> None:
    log = FieldLog()
    for index in range(1, needed + (30 if learned else 0)):
        success = index >= needed
        message = {
            "index": index,
            "explored": bool(not success and rng.random() < 0.6),
            "reward": 100.0 if success else -5.0 - 10 * rng.random(),
            "success": success,
            "duration_s": 1.6,
            "peak_displacement_m": 0.3,
            "half_swings": 3,
        }
        log.write("/learn/rollout", 4.0 * index, message)
    for step in range(200):
        pose = {"parent": "world", "child": "cup", "position_m": (0.0, 0.0, 1.0)}
        log.write("/learn/cup", 0.004 * step, pose)
    metrics = {
        "learned": learned,
        "solved": learned,
        "rollouts_to_learned": max(1, needed - 1),
        "rollouts_to_solved": needed,
        "rollouts": needed + 29,
        "frozen_success_rate": 0.95,
        "frozen_visual_caught_rate": 0.9,
        "frozen_caught_rate": float(1 - 0.05 * rng.random()) if learned else 0.2,
        "random_success_rate": 0.0025,
        "half_swings": float(rng.integers(3, 5)),
        "time_to_goal_s": float(1.5 + 0.2 * rng.random()),
        "peak_displacement_m": 0.39,
    }
    log.finish(path, stage="learn", settings={"learn": {"count": {"cap": CAP}}}, metrics=metrics)


def _transfer(path: Path, body: dict[str, float], *, given: int, scratch: int) -> None:
    log = FieldLog()
    rollout = {"explored": False, "reward": 1.0, "duration_s": 1.5, "peak_displacement_m": 0.3, "half_swings": 3}
    for topic, needed in (("/transfer/rollout", given), ("/transfer/scratch/rollout", scratch)):
        for index in range(1, needed + 10):
            log.write(topic, 2.0 * index, {**rollout, "index": index, "success": index >= needed})
    metrics = {
        "rollouts": given,
        "learned": True,
        "rollouts_from_scratch": scratch,
        "learned_from_scratch": scratch < 20,
        "success_rate_before": 0.85,
        "success_rate_after": 0.975,
        "games": 4,
        "caught_rate": 0.75,
    }
    made = {"rope_scale": 1.05, "lag_s": 0.015, "latency_s": 0.01, "ball_noise_m": 0.0005, **body}
    settings = {"hardware": {"kind": "twin", "imperfection": made}, "transfer": {"evaluation_rollouts": 40, "games": 4}}
    log.finish(path, stage="transfer", settings=settings, metrics=metrics)


if __name__ == "__main__":  # a process of its own: the report of the runs listed in argv[1]
    LISTED = json.loads(Path(sys.argv[1]).read_text())
    sys.stdout.write(
        make_sweep_report("made up", [(run, {name: Path(log) for name, log in logs.items()}) for run, logs in LISTED])
    )
