"""One made-up run, written once."""

import json
from pathlib import Path

import pytest

from kendama_cli.report.page import make_report
from tests.once import made_once
from tests.report.synthetic_run import write_run


@pytest.fixture(scope="session")
def run_folder() -> Path:
    def write(folder: Path) -> None:
        folder.mkdir()
        run, _ = write_run(folder)
        (folder / "run.json").write_text(json.dumps(run))

    return made_once("synthetic-run", write)


@pytest.fixture(scope="session")
def run(run_folder):
    return json.loads((run_folder / "run.json").read_text())


@pytest.fixture(scope="session")
def logs(run, run_folder):
    return {stage["name"]: run_folder / f"{stage['name']}.mcap" for stage in run["stages"]}


@pytest.fixture(scope="session")
def page(run, logs):
    """Its report."""
    return made_once("page.html", lambda path: path.write_text(make_report(run, logs), encoding="utf-8")).read_text()
