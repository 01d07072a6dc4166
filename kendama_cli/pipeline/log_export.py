"""Exports of logs: each format comes by the entry point group ``kendama.exporters``, whose values are exporters."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from kendama_cli.errors import UsageError
from kendama_cli.pipeline.artifact_place import log_path
from kendama_cli.schema.hints import nearest
from kendama_cli.schema.registry import brought, declared, missing_part

EXPORTERS = "kendama.exporters"


@dataclass(frozen=True)
class ExportRequest:
    """Request of ``kendama log export``.

    ``place`` is a RUN, RUN/STAGE, STAGE or a log's FILE of the folder ``home``; ``output`` a file or folder, None for
    the exporter's own choice; ``topic`` the only one to export, None for all; ``fps`` the frames per second of formats
    that have frames.
    """

    home: Path
    place: str
    output: Path | None
    topic: str | None
    fps: int


Exporter = Callable[[ExportRequest], list[Path]]
"""Writes what is asked for; returns the files or folders written. Raises UsageError for what its format has not."""


def exporter(form: str) -> Exporter:
    """Return the exporter of the format ``form``; raises UsageError where there is none, MissingPartError of a part."""
    known = declared(EXPORTERS)
    if form not in known and missing_part(EXPORTERS, form) is None:
        raise UsageError(f"--format is '{form}'; allowed: {', '.join(sorted(known))}{nearest(form, known)}")
    found: Exporter = brought(f"--format {form}", EXPORTERS, form)
    return found


def export_table(request: ExportRequest) -> list[Path]:
    """Write the log as Parquet or CSV: see ``kendama_cli.log.export``."""
    from kendama_cli.log.export import export  # noqa: PLC0415 - pandas

    output = request.output or Path(f"{Path(request.place).stem}.csv")
    return export(log_path(request.home, request.place), output, request.topic)
