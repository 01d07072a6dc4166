"""Reports: finds the logs of one run's or many runs' stages and has the page made from them alone.

Other forms than the page come by the entry point group ``kendama.reports``.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from kendama_cli.pipeline.artifact_place import LOG, broken_off_log
from kendama_cli.report.page import make_report
from kendama_cli.report.sweep_page import make_sweep_report
from kendama_cli.schema.declaration import section_names
from kendama_cli.schema.registry import brought
from kendama_cli.store import durable


@dataclass(frozen=True)
class ReportRequest:
    """Request of ``kendama report --FORM OUTPUT``: the runs' records, the home that holds them, and options."""

    records: Sequence[Mapping[str, Any]]
    output: Path
    home: Path
    width_mm: float | None


def report_form(option: str, form: str) -> Callable[[ReportRequest], str]:
    """Return what writes a report's ``form`` for ``option`` and returns a line about it; raises MissingPartError."""
    found: Callable[[ReportRequest], str] = brought(option, "kendama.reports", form)
    return found


def write_report(records: Sequence[Mapping[str, Any]], output: Path | None) -> Path:
    """Write the page for one run, or for several beside each other; where it is (by default in the current folder)."""
    names = [str(record["run"]) for record in records]
    if len(records) == 1:
        path = output or Path(f"kendama-{names[0]}.html")
        page = make_report(records[0], {**logs_of(records[0]), **_broken_off(records[0])})
    else:
        path = output or Path(f"kendama-{min(names)}-and-{len(names) - 1}-more.html")
        pipelines = " and ".join(sorted({str(record["pipeline"]) for record in records}))
        page = make_sweep_report(f"{pipelines}: {len(names)} runs", [(record, logs_of(record)) for record in records])
    durable.write_file(path.absolute(), page.encode())
    return path


def logs_of(record: Mapping[str, Any]) -> dict[str, Path]:
    """Return the log of each stage that ended, and those beside the run of which sections are made."""
    logs = {
        str(stage["name"]): Path(stage["artifact"]) / LOG for stage in record["stages"] if stage["artifact"] is not None
    }
    beside = {name: section_log(record, name) for name in section_names()} if "folder" in record else {}
    return {**logs, **{name: path for name, path in beside.items() if path.exists()}}


def section_log(record: Mapping[str, Any], name: str) -> Path:
    """Return the path beside the run ``record`` of the log from which a report's section ``name`` is made."""
    return Path(record["folder"]) / f"{name}.mcap"


def _broken_off(record: Mapping[str, Any]) -> dict[str, Path]:
    """Return the logs of failed stages up to the failure, by stage."""
    failed = [str(stage["name"]) for stage in record["stages"] if stage["status"] == "failed"]
    logs = {name: broken_off_log(Path(record["folder"]), name) for name in failed if "folder" in record}
    return {name: path for name, path in logs.items() if path.exists()}
