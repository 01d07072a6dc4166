"""Forms of a report beside the page, for the entry point group ``kendama.reports``."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING

from kendama_cli.cli import render
from kendama_cli.cli.progress import LINE_PERIOD_S
from kendama_cli.schema.units import count_of

if TYPE_CHECKING:  # pandas
    from kendama_cli.pipeline.report import ReportRequest


def figures(request: ReportRequest) -> str:
    """Write figures and tables for a paper into a folder; a line about it."""
    from kendama_cli.plugins.publication.report_export import export_report  # noqa: PLC0415 - matplotlib

    files = export_report(request.records, request.output, request.home, request.width_mm)
    return f"{request.output}: {count_of(len(files), 'file')}"


def video(request: ReportRequest) -> str:
    """Write the video of a run, with its progress on standard error; a line about it."""
    from kendama_cli.plugins.publication.video_file import video_of_run  # noqa: PLC0415 - the ray caster

    told_s = time.monotonic()

    def progress(done: int, total: int) -> None:
        nonlocal told_s
        if done < total and time.monotonic() - told_s >= LINE_PERIOD_S:
            told_s = time.monotonic()
            render.note(f"{request.output.name}: {done}/{total} images")

    count = video_of_run(request.records, request.output, progress)
    return f"{request.output}: {count_of(count, 'image')}"
