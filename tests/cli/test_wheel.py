"""The wheel alone, in a new virtual environment and an empty folder, does the work: conf, pipelines and data travel."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

from tests.documented_package import new_environment

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture(scope="module")
def installed(wheel: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A new environment with the wheel; the libraries come from the test's own, our package does not."""
    return new_environment(tmp_path_factory.mktemp("venv"), wheel) / "kendama"


def test_conf_pipelines_and_data_are_in_the_wheel_and_tests_are_not(wheel: Path) -> None:
    names = zipfile.ZipFile(wheel).namelist()
    for wanted in (
        "conf/config.yaml",
        "pipelines/kendama.yaml",
        "data/robots/pa10.urdf",
        "data/demonstrations/",
        "examples/course/exercises/1-",
    ):
        assert any(name.startswith(f"kendama_cli/bundled/{wanted}") for name in names), wanted
    assert not [name for name in names if "tests/" in name or "test_" in name or "solutions" in name]
    assert any(name.endswith("licenses/LICENSE") for name in names)


def test_the_installed_command_runs_on_the_bundled_demonstrations_from_an_empty_folder(
    installed: Path, tmp_path: Path
) -> None:
    environment = {key: value for key, value in os.environ.items() if key not in ("PYTHONPATH", "KENDAMA_HOME")}
    done = subprocess.run(
        [installed, "run", "-p", "imitation", "--until", "encode", "--json"],
        cwd=tmp_path,
        env=environment,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    stages = {stage["name"]: stage for stage in json.loads(done.stdout)["stages"]}
    assert stages["capture"]["metrics"]["n_demonstrations"] >= 10
    assert stages["encode"]["metrics"]["n_parameters"] == 22
    where = subprocess.check_output(
        [installed.parent / "python", "-c", "import kendama_cli; print(kendama_cli.__file__)"], cwd=tmp_path, text=True
    )
    assert str(installed.parent.parent) in where


def test_the_sdist_builds_the_same_wheel_byte_for_byte(wheel: Path, tmp_path: Path) -> None:
    def build(what: str, source: Path, to: Path) -> Path:
        command = [sys.executable, "-m", "hatchling", "build", "-t", what, "-d", str(to)]
        subprocess.run(command, cwd=source, check=True, capture_output=True)
        return next(to.iterdir())

    archive = build("sdist", ROOT, tmp_path / "sdist")
    # the tarfile module's own command: extractall has had no filter before 3.11.4, and warns without one from 3.12 on
    subprocess.run([sys.executable, "-m", "tarfile", "-e", str(archive), str(tmp_path)], check=True)
    unpacked = tmp_path / archive.name.removesuffix(".tar.gz")
    assert build("wheel", unpacked, tmp_path / "wheel").read_bytes() == wheel.read_bytes()
