"""The core without any part: built as a wheel from a copy that has no ``plugins/``, it does the main job."""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import zipfile
from pathlib import Path

import pytest

from tests.documented_package import new_environment, wheel_of
from tests.plugins.test_parts_table import brought
from tests.test_whole_game import SMALL
from tests.toy_project import statuses

ROOT = Path(__file__).resolve().parents[2]
STAGES = ("capture", "encode", "adapt", "learn", "predict", "transfer")

pytestmark = [pytest.mark.slow, pytest.mark.timeout(1200)]  # kernels are compiled for a new environment


@pytest.fixture(scope="module")
def core(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """An empty folder beside ``venv/``, an environment with the core's wheel and the libraries of the test's own."""
    source = tmp_path_factory.mktemp("source")
    for name in ("kendama_cli", "conf", "pipelines", "data", "docs", "examples"):
        shutil.copytree(ROOT / name, source / name, ignore=shutil.ignore_patterns("__pycache__", "plugins"))
    for name in ("README.md", "LICENSE"):
        shutil.copy(ROOT / name, source)
    (source / "pyproject.toml").write_text(without_parts((ROOT / "pyproject.toml").read_text()))
    folder = tmp_path_factory.mktemp("core")
    wheel = wheel_of(source, folder)
    assert not [name for name in zipfile.ZipFile(wheel).namelist() if "plugins" in name]
    new_environment(folder / "venv", wheel)
    return folder


def without_parts(project: str) -> str:
    """Return ``pyproject.toml`` without the entry points of parts."""
    kept = [line for line in project.splitlines() if ' = "kendama_cli.plugins.' not in line]
    return "\n".join(kept) + "\n"


def kendama(core: Path, *words: str, expect: int = 0) -> subprocess.CompletedProcess[str]:
    environment = {key: value for key, value in os.environ.items() if not key.startswith(("PYTHON", "KENDAMA"))}
    work = core / "work"
    work.mkdir(exist_ok=True)
    command = [str(core / "venv" / "bin" / "kendama"), *words]
    done = subprocess.run(command, cwd=work, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == expect, done.stderr or done.stdout
    return done


def test_it_plans_runs_compares_and_reports_the_main_job(core: Path) -> None:
    planned = kendama(core, "plan").stdout
    assert all(re.search(rf"^{stage} +run", planned, re.M) for stage in STAGES)
    first = json.loads(kendama(core, "run", "--json", *SMALL).stdout)
    assert statuses(first) == dict.fromkeys(STAGES, "ran")
    assert statuses(json.loads(kendama(core, "run", "--json", *SMALL).stdout)) == dict.fromkeys(STAGES, "cached")
    page = core / "work" / kendama(core, "report").stdout.strip()
    assert page.stat().st_size > 100_000
    sweep = ("sweep", "-p", "swingup", "--until", "learn", "--json", "simulation/engine=rail", "seed=1,2")
    runs = json.loads(kendama(core, *sweep).stdout)["runs"]
    assert [one["outcome"] for one in runs] == ["done", "done"]


def test_what_is_missing_is_told_in_one_line_with_the_part_that_has_it(core: Path) -> None:
    for words, part in (
        (("plan", "hardware=franka"), "franka"),
        (("plan", "hardware=rsi"), "kuka_rsi"),
        (("plan", "learn/learner=dyna"), "learners"),
        (("run", "--on", "dask"), "cluster"),
        (("plan", "store.remote=/mnt/shared"), "cluster"),
        (("cache", "push", "--remote", "/mnt/shared"), "cluster"),
        (("log", "export", "1", "--format", "lerobot"), "lerobot"),
        (("course", "list"), "course"),
        (("play", "--no-show"), "teleoperation"),
        (("plan", "capture=haptic"), "teleoperation"),
        (("plan", "capture=mocap"), "mocap"),
        (("camera", "marker"), "marker"),
        (("plan", "capture=marker_live"), "marker"),
        (("cross-check",), "mujoco"),
        (("run", "--watch", "--no-show"), "watch"),
        (("cache", "migrate"), "migration"),
        (("config", "--migrate", "mine.yaml"), "migration"),
        (("run", "-p", "press"), "interact"),
        (("explain", "learn.alpha"), "help"),
    ):
        told = kendama(core, *words, expect=2).stderr
        assert told.count("\n") == 1, told
        assert f" comes with the part {part}, which this installation lacks" in told


def test_every_part_is_absent_and_nothing_misses_it(core: Path) -> None:
    probe = (
        "import json; from kendama_cli.schema.registry import declared, groups, resolve;"
        "found = {group: declared(group) for group in groups()};"
        "[resolve(target, name) for named in found.values() for name, target in named.items()];"
        "print(json.dumps({group: list(named) for group, named in found.items()}))"
    )
    python = [core / "venv" / "bin" / "python", "-P", "-c", probe]
    declared = json.loads(subprocess.run(python, cwd=core, capture_output=True, text=True, check=True).stdout)
    for groups in brought().values():
        for group, names in groups.items():
            assert not set(declared.get(group, ())) & set(names), group
    assert "course" not in kendama(core, "--help").stdout
