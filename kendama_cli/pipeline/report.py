"""A run's report: finds the logs of its stages and has the page made from them alone."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from kendama_cli.report.page import make_report
from kendama_cli.store import durable


def write_report(record: Mapping[str, Any], output: Path | None) -> Path:
    """Write the page for a run's ``record``; returns where it is (by default beside the record of the run)."""
    logs = {
        str(stage["name"]): Path(stage["artifact"]) / "log.mcap"
        for stage in record["stages"]
        if stage["artifact"] is not None
    }
    page = make_report(record, logs)
    path = output or Path(f"kendama-{record['run']}.html")
    durable.write_file(path.absolute(), page.encode())
    return path
