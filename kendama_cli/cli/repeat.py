"""The quick way of ``kendama run``: where it has nothing to do, what it prints without parsing the command line."""

from __future__ import annotations

from kendama_cli.cli import render
from kendama_cli.pipeline.command_cache import CommandKey, repeat
from kendama_cli.pipeline.record import RunRecord, elsewhere_notice


def repeat_run(asked: CommandKey) -> int | None:
    """Repeat the run that ``asked`` is, and its exit code; None where it has to be planned."""
    record = repeat(asked)
    if record is None:
        return None
    for stage in record.stages:
        render.note(f"{stage.name}: {stage.status}")
    show_end(record, as_json="--json" in asked.arguments)
    return 0


def show_end(record: RunRecord, *, as_json: bool) -> None:
    """Show how a run ended."""
    if (elsewhere := elsewhere_notice(record)) is not None:
        render.note(elsewhere)
    if as_json:
        render.document(record.document())
    else:
        render.summary(record, next_step(record))


def next_step(record: RunRecord) -> str:
    """Return the next step to take after a run."""
    if record.outcome == "failed" and not record.is_recorded:
        return "nothing was computed, so it is not among the runs"
    if not record.is_recorded:
        return f"not recorded: {record.home} cannot be written"
    return f"see it with: kendama report {record.run}"
