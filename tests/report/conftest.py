"""One made-up run, written once."""

import json
from pathlib import Path

import pytest

from kendama_cli.report.page import make_report
from tests.report.synthetic_run import write_run


@pytest.fixture(scope="session")
def run_folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("run")
    run, _ = write_run(folder)
    (folder / "run.json").write_text(json.dumps(run))
    return folder


@pytest.fixture(scope="session")
def run(run_folder):
    return json.loads((run_folder / "run.json").read_text())


@pytest.fixture(scope="session")
def logs(run, run_folder):
    return {stage["name"]: run_folder / f"{stage['name']}.mcap" for stage in run["stages"]}


@pytest.fixture(scope="session")
def page(run, logs):
    """Its report."""
    return make_report(run, logs)
