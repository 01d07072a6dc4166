"""A sweep while it goes on, and what it says at its end."""

from __future__ import annotations

import io
import re
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import pytest
from rich.console import Console

from kendama_cli.cli import render
from kendama_cli.cli.sweep_view import RUNS_LISTED, SweepView, show_sweep
from kendama_cli.pipeline.record import RunRecord, StageOutcome
from kendama_cli.pipeline.sweep import SweepJob
from tests.toy_project import ToyProject


def outcome(status: str = "ran", error: str | None = None, **metrics: Any) -> StageOutcome:
    return StageOutcome("learn", "learn", "key", status, 1.0, None, metrics, error)


def record(number: int, overrides: list[str], stage: StageOutcome) -> RunRecord:
    ended = "failed" if stage.status == "failed" else "done"
    return RunRecord(Path("home"), f"run-{number}", "swingup", overrides, "today", ended, [stage])


def job(*overrides: str) -> SweepJob:
    stages = [SimpleNamespace(name="learn")]
    return SweepJob(list(overrides), cast(Any, SimpleNamespace(pipeline=SimpleNamespace(stages=stages))))


def test_one_bar_counts_the_runs_and_keeps_failures_in_sight() -> None:
    screen = io.StringIO()
    jobs = [job(f"seed={seed}") for seed in range(4)]
    with SweepView(jobs, Console(file=screen, force_terminal=True, width=110)) as view:
        for seed, one in enumerate(jobs[:3]):
            watched = view.watch(one, record(seed, one.overrides, outcome()))
            watched.stage_starts("learn", "key", ())
            failed = seed == 1
            watched.stage_ends(
                outcome("failed", "the rope broke") if failed else outcome(rollouts_to_solved=100 + seed)
            )
    frame = re.sub(r"\x1b\[[0-9;?]*[a-zA-Z]", "", screen.getvalue()).replace("\r", "").rpartition("runs ")[2]
    assert "3/4" in frame
    assert "/min" in frame
    assert "last  seed=2: rollouts_to_solved 102" in frame
    assert "✗ seed=1: learn: the rope broke" in frame


def test_many_runs_are_told_by_medians_and_means_with_intervals_and_every_failure(
    capsys: pytest.CaptureFixture[str],
) -> None:
    records = [
        record(seed, [f"learn.alpha={alpha}", f"seed={seed}"], outcome(rollouts_to_solved=seed + 10, solved=True))
        for alpha in (0.3, 0.5)
        for seed in range(RUNS_LISTED)
    ]
    records.append(record(99, ["learn.alpha=0.5", "seed=99"], outcome("failed", "the rope broke")))
    show_sweep(records)
    lines = capsys.readouterr().out.splitlines()
    assert len(lines) == 1 + 4 + 2, "a head, two metrics of two settings, the failure, the count"
    assert re.search(
        r"learn\.alpha=0\.3 +8 +rollouts_to_solved +13\.5 \[10, 17\]; mean 13\.5 \[11\.\d+, 15\.\d+\]", lines[1]
    )
    assert lines[-2] == "run-99 failed  learn.alpha=0.5 seed=99  the rope broke"
    assert lines[-1] == "16 of 17 runs done, 1 not"


def test_a_few_runs_are_listed_one_by_one(capsys: pytest.CaptureFixture[str]) -> None:
    show_sweep([record(1, ["seed=1"], outcome(rollouts_to_solved=7))])
    assert capsys.readouterr().out.splitlines()[1].split() == ["run-1", "done", "seed=1", "rollouts_to_solved", "7"]


def test_a_sweep_that_is_piped_prints_a_line_where_a_stage_starts_and_ends(toy: ToyProject) -> None:
    done = toy.kendama("sweep", "-p", "toy", "seed=1,2")
    assert "[1/2 seed=1] total: done" in done.stderr
    assert "2 of 2 runs done" in done.stdout
    assert "\x1b" not in done.stderr + done.stdout


def test_headline_metrics_come_first_and_warnings_last(capsys: pytest.CaptureFixture[str]) -> None:
    first, second = outcome(n=1, warnings="too few"), outcome(n=2)
    made = RunRecord(Path("home"), "run-1", "swingup", [], "today", "done", [first, second])
    render.summary(made, "next")
    lines = capsys.readouterr().out.splitlines()
    assert [line.split()[1] for line in lines] == ["ran", "ran", "warns", "in", "run-1"]
