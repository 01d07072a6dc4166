"""The parts of examples/bench, which the how-to pages show, beside ours: chosen by kind, conforming, and run."""

from __future__ import annotations

import importlib
import json
import os
import subprocess
import sys
from collections.abc import Iterable, Mapping
from pathlib import Path

import pytest

from kendama_cli.schema.registry import declared
from tests import warm_command
from tests.documented_package import install_example

DEMONSTRATOR, CAMERA, ROBOT, CONTROLLER, DETECTOR, LEARNER = (
    "demonstrator",
    "camera",
    "robot",
    "controller",
    "detector",
    "learner",
)
DOCUMENTED = {
    DEMONSTRATOR: "capture=bench",
    CAMERA: "camera=bench",
    ROBOT: "hardware=bench",
    DETECTOR: "predict/detector=bench",
    LEARNER: "learn/learner=bench",
}
SHIPPED = [
    {
        DEMONSTRATOR: "capture=file",
        CAMERA: "camera=virtual",
        DETECTOR: "predict/detector=colour",
        LEARNER: "learn/learner=sarsa",
    },
    {LEARNER: "learn/learner=random_replay"},
    pytest.param({ROBOT: "hardware=twin"}, marks=pytest.mark.slow),  # of robots, the documented one goes through it
]


@pytest.fixture(scope="module")
def bench(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the documented package, as if it were installed."""
    folder = tmp_path_factory.mktemp("bench")
    install_example("bench", folder)
    return folder


def _environment(folder: Path) -> dict[str, str]:
    return {**os.environ, "PYTHONPATH": str(folder), "PYTHONDONTWRITEBYTECODE": "1"}


def _kendama(folder: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    return warm_command.kendama(arguments, folder, _environment(folder), 240, libraries=True)


def _conformance(folder: Path, *suites: str, overrides: Iterable[str]) -> subprocess.CompletedProcess[str]:
    words = [word for override in overrides for word in ("--override", override)]
    plain = ("pytest", "-q", "-rp", "-p", "no:cacheprovider", "-p", "no:xdist")
    words = ["-m", *plain, "-p", "kendama_cli.conformance", *(f"--suite={suite}" for suite in suites), *words]
    return warm_command.python(words, folder, _environment(folder), 240)


def _check_passed(folder: Path, parts: Mapping[str, str]) -> None:
    """One command for all ``parts``: pytest and the libraries are imported once."""
    done = _conformance(folder, *parts, overrides=parts.values())
    assert done.returncode == 0, done.stdout + done.stderr
    for suite in parts:
        module = importlib.import_module(declared("kendama.suites")[suite].partition(":")[0])
        (test,) = (name for name in vars(module) if name.startswith("test_"))
        assert f"\nPASSED ::{test}[" in done.stdout, suite


def test_documented_parts_pass_their_conformance_suites_chosen_by_kind_alone(bench: Path) -> None:
    _check_passed(bench, DOCUMENTED)


@pytest.mark.parametrize("parts", SHIPPED, ids=lambda parts: " ".join(parts.values()))
def test_our_own_parts_go_through_the_same_command(tmp_path: Path, parts: Mapping[str, str]) -> None:
    _check_passed(tmp_path, parts)


def test_the_suite_names_the_law_that_a_part_breaks(bench: Path) -> None:
    done = _conformance(bench, ROBOT, overrides=["hardware=bench", "hardware.compliance_rad_nm=1e-9"])
    assert done.returncode == 1
    assert "broken law: an added effort moves the arm out of its rest" in done.stdout


def test_the_suite_does_not_move_a_robot_that_may_be_real_without_being_armed(tmp_path: Path) -> None:
    done = _conformance(tmp_path, ROBOT, overrides=["hardware=command"])
    assert done.returncode == 1
    assert "robot 'command' may be real and would move; clear its surroundings and add --arm" in done.stdout


def test_a_kind_that_nobody_declares_is_refused_with_those_that_are_there(bench: Path) -> None:
    done = _conformance(bench, ROBOT, overrides=["hardware.kind=bonch"])
    assert (
        "'hardware.kind' is 'bonch', did you mean 'hardware.kind=bench'? Allowed: bench, " in done.stdout + done.stderr
    )


def test_a_documented_hand_is_captured_by_its_kind_alone(bench: Path) -> None:
    (bench / "pipelines").mkdir(exist_ok=True)
    (bench / "pipelines" / "swings.yaml").write_text("stages:\n  capture: {config: [capture]}\n")
    done = _kendama(bench, "run", "-p", "swings", "--json", "capture=bench")
    assert done.returncode == 0, done.stderr
    metrics = json.loads(done.stdout)["stages"][0]["metrics"]
    assert metrics["n_demonstrations"] == 2
    assert metrics["sample_rate_hz"] == pytest.approx(200.0)


def test_a_documented_stage_has_an_artifact_a_log_and_a_chapter_in_the_report(bench: Path) -> None:
    done, again = (_kendama(bench, "run", "-p", "tempo", "--json", "capture=bench") for _ in range(2))
    assert done.returncode == 0, done.stderr
    assert {stage["status"] for stage in json.loads(again.stdout)["stages"]} == {"cached"}
    shown = _kendama(bench, "log", "peaks")
    assert [line.split(":")[0] for line in shown.stdout.splitlines()] == [f"tau x {x}" for x in (0.8, 1.0, 1.2, 1.4)]
    assert _kendama(bench, "log", "export", "tempo", "--format", "peaks").stdout == "peaks.txt\n"
    planned = _kendama(bench, "plan", "-p", "tempo", "capture=bench", "tempo.allowed_m_s=0.9")
    assert "config tempo.allowed_m_s 1.2 -> 0.9" in planned.stdout
    wrong = _kendama(bench, "plan", "-p", "tempo", "capture=bench", "tempo.allowed_m_s=-1")
    assert (wrong.returncode, "'tempo.allowed_m_s' is -1.0; allowed: above 0" in wrong.stderr) == (2, True)
    code = (
        "import kendama_cli as kendama; run = kendama.open_run(); study = run.artifact('tempo');"
        "print(type(study).__name__, study.tau_scale.tolist(), list(run.log('tempo').table('/tempo/scale')))"
    )
    shown = subprocess.check_output([sys.executable, "-c", code], cwd=bench, env=_environment(bench), text=True)
    assert shown.startswith("TempoStudy [0.8, 1.0, 1.2, 1.4]")
    assert "peak_speed_m_s" in shown
    done = _kendama(bench, "report", "-o", "page.html")
    assert done.returncode == 0, done.stderr
    assert "Speed over time scale" in (bench / "page.html").read_text()


def test_a_documented_learner_learns_in_the_stage_by_its_kind_alone(bench: Path) -> None:
    quick = ("simulation/engine=rail", "learn.count.max_rollouts=30", "learn.count.evaluation_rollouts=5")
    words = ("run", "-p", "swingup", "--until", "learn", "--json", "learn/learner=bench", *quick)
    done = _kendama(bench, *words)
    assert done.returncode == 0, done.stderr
    assert 1 <= json.loads(done.stdout)["stages"][0]["metrics"]["rollouts"] <= 30


def test_a_documented_camera_and_detector_are_checked_by_their_kinds_alone(bench: Path) -> None:
    words = ("camera", "check", "--seconds", "0.3", "--json", "camera=bench", "predict/detector=bench")
    done = _kendama(bench, *words)
    assert done.returncode == 0, done.stderr
    (front,) = json.loads(done.stdout)["cameras"].values()
    assert front["frames"] >= 5
    assert front["seen"] == 0.0
