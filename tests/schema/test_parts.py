"""Missing things are named with the part that brings them, wherever configuration or a pipeline names them."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from kendama_cli.conformance import suite_file
from kendama_cli.errors import ConfigError, MissingPartError, UsageError
from kendama_cli.pipeline.catalogue import load_pipeline
from kendama_cli.pipeline.log_export import exporter
from kendama_cli.pipeline.nodes import build_settings
from kendama_cli.schema import registry
from kendama_cli.schema.settings import build, build_value
from kendama_cli.settings.executor import ExecutorSettings
from kendama_cli.settings.store import StoreSettings

BROUGHT = {
    "kendama.executors": ["abacus"],
    "kendama.stores": ["drawer"],
    "kendama.exporters": ["stone"],
    "kendama.settings": ["hourglass"],
    "kendama.stages": ["nap"],
    "kendama.suites": ["hourglass"],
}


@pytest.fixture(autouse=True)
def sundries(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """One part that is not installed."""
    table = tmp_path / "parts.json"
    table.write_text(json.dumps({"sundries": BROUGHT}))
    monkeypatch.setattr(registry, "TABLE", table)


def missing(what: str) -> str:
    return f"{what} comes with the part sundries, which this installation lacks; install the whole of kendama-cli"


STORE: dict[str, Any] = {"endpoint": None, "timeout_s": 1.0}


@pytest.mark.parametrize(
    ("ask", "part", "what", "unknown", "says"),
    [
        (
            lambda kind: build_value(ExecutorSettings, {"kind": kind}, "executor"),
            "abacus",
            "executor=abacus",
            "abacs",
            r"'executor\.kind' is 'abacs'; allowed: dask, local, slurm",
        ),
        (
            lambda remote: build(StoreSettings, {"remote": remote, **STORE}, "store"),
            "drawer://left",
            "store.remote=drawer://left",
            "chest://left",
            r"'store\.remote' is 'chest://left'; allowed: a folder, or a URL",
        ),
        (exporter, "stone", "--format stone", "tabl", r"--format is 'tabl'; allowed: .*, did you mean 'table'\?"),
        (suite_file, "hourglass", "--suite hourglass", "robo", r"--suite is 'robo'; allowed: camera, controller, "),
    ],
)
def test_what_a_missing_part_brings_names_the_part_and_an_unknown_name_is_refused(
    ask: Callable[[str], object], part: str, what: str, unknown: str, says: str
) -> None:
    with pytest.raises(MissingPartError) as told:
        ask(part)
    assert str(told.value) == missing(what)
    with pytest.raises((ConfigError, UsageError), match=says):
        ask(unknown)


def test_a_stage_of_a_part_is_reported(tmp_path: Path) -> None:
    pipeline = tmp_path / "mine.yaml"
    pipeline.write_text("stages: {nap: {}}\n")
    with pytest.raises(MissingPartError) as told:
        load_pipeline(str(pipeline), [])
    assert str(told.value) == missing(f"{pipeline}: stage 'nap'")


def test_a_node_of_a_part_is_left_out_until_something_needs_it() -> None:
    built = build_settings({"seed": 3, "hourglass": {"sand": 1}})
    assert built == {"seed": 3}
    with pytest.raises(MissingPartError) as told:
        built["hourglass"]
    assert str(told.value) == missing("node 'hourglass'")
    with pytest.raises(ConfigError, match="unknown key 'sundial'"):
        build_settings({"seed": 3, "sundial": {}})
