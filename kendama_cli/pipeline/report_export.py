"""A report's figures and tables as files; apart from the page, which needs no matplotlib where nothing is plotted."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from kendama_cli.pipeline.report import logs_of
from kendama_cli.pipeline.run_facts import flat
from kendama_cli.report.export import Files
from kendama_cli.report.page import make_report
from kendama_cli.report.plot import drawn_for_print
from kendama_cli.report.sweep_page import make_sweep_report
from kendama_cli.store import durable


def export_report(records: Sequence[Mapping[str, Any]], folder: Path) -> list[Path]:
    """Write the figures of one run, or of several beside each other, and their metrics into ``folder``; which files."""
    files = Files()
    with drawn_for_print(files.figure):
        if len(records) == 1:
            make_report(records[0], logs_of(records[0]))
        else:
            make_sweep_report("", [(record, logs_of(record)) for record in records])
    if len(records) == 1:
        for stage in records[0]["stages"]:
            files.metrics(str(stage["name"]), stage["metrics"])
    else:
        metrics_of = [_metrics(record) for record in records]
        names = list(dict.fromkeys(name for metrics in metrics_of for name in metrics))
        rows = [
            (record["run"], *(metrics.get(name) for name in names))
            for record, metrics in zip(records, metrics_of, strict=True)
        ]
        files.table("metrics", ("run", *names), rows)
    with durable.plain_disk_errors(folder):
        folder.mkdir(parents=True, exist_ok=True)
    for name, content in files.made.items():
        durable.write_file((folder / name).absolute(), content)
    return [folder / name for name in sorted(files.made)]


def _metrics(record: Mapping[str, Any]) -> dict[str, Any]:
    return {key: value for one in record["stages"] for key, value in flat(str(one["name"]), one["metrics"]).items()}
