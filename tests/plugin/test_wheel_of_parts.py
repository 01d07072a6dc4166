"""The package examples/bench, built as a wheel and installed beside ours in a new environment."""

from __future__ import annotations

import json
import os
import subprocess
from pathlib import Path

import pytest

from tests.documented_package import copy_example, new_environment, wheel_of


@pytest.fixture(scope="module")
def laboratory(wheel: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with ``conf/`` and ``pipelines/`` of the documented package, and ``venv/`` with its wheel and ours."""
    folder = tmp_path_factory.mktemp("laboratory")
    source = tmp_path_factory.mktemp("source")
    copy_example("bench", source)
    for name in ("conf", "pipelines"):
        (source / name).rename(folder / name)
    new_environment(folder / "venv", wheel, wheel_of(source, folder / "wheels"))
    return folder


def kendama(laboratory: Path, *words: str, timeout_s: float = 240) -> subprocess.CompletedProcess[str]:
    environment = {key: value for key, value in os.environ.items() if not key.startswith(("PYTHON", "KENDAMA"))}
    return subprocess.run(
        [laboratory / "venv" / "bin" / "kendama", *words],
        cwd=laboratory,
        env=environment,
        capture_output=True,
        text=True,
        check=False,
        timeout=timeout_s,
    )


@pytest.mark.slow  # tests/cli/test_wheel.py runs ours
def test_both_wheels_are_what_is_run(laboratory: Path) -> None:
    code = "import bench, kendama_cli; print(bench.__file__, kendama_cli.__file__)"
    python = laboratory / "venv" / "bin" / "python"
    for file in subprocess.check_output([python, "-P", "-c", code], cwd=laboratory, text=True).split():
        assert Path(file).is_relative_to(laboratory / "venv")


@pytest.mark.slow  # kernels are compiled for a new environment; test_documented_parts.py has them compiled
def test_its_stage_runs_in_a_pipeline_on_its_own_hand_and_is_cached_and_planned(laboratory: Path) -> None:
    run = ("run", "-p", "tempo", "--json", "capture=bench")
    first, again = kendama(laboratory, *run), kendama(laboratory, *run)
    assert first.returncode == again.returncode == 0, first.stderr + again.stderr
    stages = {stage["name"]: stage for stage in json.loads(first.stdout)["stages"]}
    assert stages["capture"]["metrics"]["n_demonstrations"] == 2
    assert stages["tempo"]["metrics"]["peak_speed_m_s"] > 0
    assert {stage["status"] for stage in json.loads(again.stdout)["stages"]} == {"cached"}
    shown = kendama(laboratory, "log", "peaks")
    assert [line.split(":")[0] for line in shown.stdout.splitlines()] == [f"tau x {x}" for x in (0.8, 1.0, 1.2, 1.4)]
    assert "peaks" in kendama(laboratory, "log", "--help").stdout
    assert kendama(laboratory, "log", "export", "tempo", "--format", "peaks").stdout == "peaks.txt\n"
    assert len((laboratory / "peaks.txt").read_text().split()) == 4
    planned = kendama(laboratory, "plan", "-p", "tempo", "capture=bench", "tempo.allowed_m_s=0.9")
    assert "config tempo.allowed_m_s 1.2 -> 0.9" in planned.stdout
    wrong = kendama(laboratory, "plan", "-p", "tempo", "capture=bench", "tempo.allowed_m_s=-1")
    assert wrong.returncode == 2
    assert "'tempo.allowed_m_s' is -1.0; allowed: above 0" in wrong.stderr


@pytest.mark.slow  # for the same reason
def test_its_artifact_and_log_are_read_and_its_chapter_is_in_the_report(laboratory: Path) -> None:
    assert kendama(laboratory, "run", "-p", "tempo", "capture=bench").returncode == 0
    code = (
        "import kendama_cli as kendama; run = kendama.open_run(); study = run.artifact('tempo');"
        "print(type(study).__name__, study.tau_scale.tolist(), list(run.log('tempo').table('/tempo/scale')))"
    )
    python = laboratory / "venv" / "bin" / "python"
    shown = subprocess.check_output([python, "-P", "-c", code], cwd=laboratory, text=True)
    assert shown.startswith("TempoStudy [0.8, 1.0, 1.2, 1.4]")
    assert "peak_speed_m_s" in shown
    assert kendama(laboratory, "report", "-o", "page.html").returncode == 0
    page = (laboratory / "page.html").read_text()
    assert "Speed over time scale" in page
    assert "the dashed line is the limit" in page


@pytest.mark.slow  # for the same reason
def test_its_learner_learns_in_the_stage_of_ours_and_its_policy_is_read(laboratory: Path) -> None:
    quick = ("learn.count.max_rollouts=30", "learn.count.evaluation_rollouts=5")
    run = ("run", "-p", "swingup", "--until", "learn", "--json", "learn/learner=bench", "simulation/engine=rail")
    done = kendama(laboratory, *run, *quick)
    assert done.returncode == 0, done.stderr
    (learn,) = json.loads(done.stdout)["stages"]
    assert 1 <= learn["metrics"]["rollouts"] <= 30
    code = (
        "import kendama_cli as kendama; policy = kendama.open_run().artifact('learn');"
        "print(policy.kind, policy.array('gains').shape)"
    )
    python = laboratory / "venv" / "bin" / "python"
    assert subprocess.check_output([python, "-P", "-c", code], cwd=laboratory, text=True) == "bench (4,)\n"
    refused = kendama(laboratory, *run, "learn.learner.resample_probability=0")
    assert refused.returncode == 2
    assert "'learn.learner.resample_probability' is 0.0; allowed: above 0" in refused.stderr
