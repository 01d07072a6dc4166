"""The README of an export: which runs, code, settings and data made each file."""

from __future__ import annotations

import textwrap
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class Result:
    """One stored result: the stage of the runs that have it, its key, and the digests of artifact and code."""

    stage: str
    runs: tuple[str, ...]
    key: str
    artifact: str
    code: str
    data: str


def readme_text(
    source: str,
    records: Sequence[Mapping[str, Any]],
    results: Sequence[Result],
    files: Mapping[str, tuple[str, str, Sequence[str]]],
) -> str:
    """Return the text; ``files`` gives for each figure or table its stage, caption and files."""
    lines = [f"Exported from {source}.", ""]
    lines += ["Every figure names its runs in its lower margin, every CSV row in the column 'run'.", "", "RUNS", ""]
    for record in records:
        made = " ".join(record["overrides"]) or "as configured"
        lines.append(f"  {record['run']}  {record['outcome']}  started {record.get('started', 'unknown')}")
        lines.append(f"    pipeline {record['pipeline']}, {made}")
        lines.append(f"    kendama {record.get('versions', {}).get('kendama', '(version unknown)')}")
        lines += [f"    read {one}" for one in record.get("read", ())]
    lines += [
        "",
        "RESULTS (key: settings, inputs and code; artifact: SHA-256 of the data; settings.csv has all values)",
        "",
    ]
    for one in results:
        lines.append(f"  {one.stage} of {', '.join(one.runs)}")
        lines.append(f"    key {one.key}, code {one.code}, artifact {one.artifact}")
        lines += [f"    data {one.data}"] if one.data else []
    lines += ["", "FILES", ""]
    for name, (stage, caption, kinds) in files.items():
        lines.append(f"  {name}: {', '.join(kinds)}{f' (stage {stage})' if stage else ''}")
        lines += textwrap.wrap(caption, 100, initial_indent="    ", subsequent_indent="    ")
    return "\n".join([*lines, ""])
