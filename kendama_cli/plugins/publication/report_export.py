"""A report's figures and tables as files that tell what they show, with a method section and where they come from.

The sentences of the methods come from the declarations of the stages and the values of the runs alone.
"""

from __future__ import annotations

import re
import textwrap
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from kendama_cli.pipeline.report import logs_of
from kendama_cli.pipeline.run_facts import flat, stage_parts
from kendama_cli.plugins.publication.files import Files
from kendama_cli.plugins.publication.latex import latex_document
from kendama_cli.report.chapters import declaration_of
from kendama_cli.report.intervals import RESAMPLES
from kendama_cli.report.page import make_report
from kendama_cli.report.receiver import made_for
from kendama_cli.report.run_table import DEFAULT, SEED, differing, overrides_of
from kendama_cli.report.source import StageLog
from kendama_cli.report.sweep_page import make_sweep_report
from kendama_cli.report.tables import label_and_unit, number
from kendama_cli.store import durable
from kendama_cli.store.store import Store
from kendama_cli.version import __version__

_VALUE = re.compile(r"\{([A-Za-z0-9_.]+)\}")


@dataclass(frozen=True)
class Facts:
    """Settings and metrics of one stage in one run."""

    settings: Mapping[str, Any]
    metrics: Mapping[str, Any]

    def value(self, key: str) -> Any:
        """Return the setting at the dotted ``key``, else the metric; None for neither."""
        found: Any = self.settings
        for part in key.split("."):
            found = found.get(part) if isinstance(found, Mapping) else None
        return self.metrics.get(key) if found is None else found


def methods_text(records: Sequence[Mapping[str, Any]], facts: Mapping[str, Sequence[Facts]]) -> str:
    """Return the section as Markdown; ``facts`` are those of each stage in the runs that have it."""
    lines = ["# Methods", "", _software(records)]
    entries = {str(stage["name"]): stage for record in records for stage in record["stages"]}
    for stage, found in facts.items():
        declaration = declaration_of(stage, entries.get(stage, {}))
        told = [_told(sentence, found) for sentence in (declaration.methods if declaration else ())]
        if sentences := [one for one in told if one]:
            assert declaration is not None
            lines += ["", f"## {declaration.title}", "", " ".join(sentences)]
    return "\n".join([*lines, "", "## Runs", "", _runs(records), ""])


def _told(sentence: str, found: Sequence[Facts]) -> str:
    """Return the sentence with its values; empty where a run lacks one."""
    values = {key: [one.value(key) for one in found] for key in _VALUE.findall(sentence)}
    if not found or any(value is None for of_runs in values.values() for value in of_runs):
        return ""
    return _VALUE.sub(lambda key: _values(key[1], values[key[1]]), sentence)


def _values(key: str, of_runs: Sequence[Any]) -> str:
    unit = label_and_unit(key.rpartition(".")[2])[1]
    return f"{listed(dict.fromkeys(map(number, of_runs)))} {unit}".strip()


def listed(words: Any) -> str:
    """Return words joined by commas and a last ``and``."""
    *first, last = words
    return f"{', '.join(first)} and {last}" if first else str(last)


def _software(records: Sequence[Mapping[str, Any]]) -> str:
    versions: dict[str, dict[str, None]] = {}
    for record in records:
        for name, version in record.get("versions", {}).items():
            versions.setdefault(name, {})[version] = None
    own = listed(versions.pop("kendama", {"(version unknown)": None}))
    named = ("python", "numpy", "scipy", "dartpy", "numba")
    others = listed([f"{name} {listed(versions[name])}" for name in named if name in versions] or ["unknown libraries"])
    pipelines = listed(dict.fromkeys(f'"{record["pipeline"]}"' for record in records))
    return f"All results were computed by the pipeline {pipelines} of kendama {own}, with {others}."


def _runs(records: Sequence[Mapping[str, Any]]) -> str:
    overrides = [overrides_of(record) for record in records]
    names = listed([str(record["run"]) for record in records])
    if len(records) == 1:
        made = listed([f"`{key}={value}`" for key, value in overrides[0].items()] or ["no override"])
        return f"The run is {names}, with {made} of the configuration."
    varied = [
        f"`{key}` ({listed(dict.fromkeys(one.get(key, DEFAULT) for one in overrides))})" for key in differing(overrides)
    ]
    seeds = list(dict.fromkeys(one.get(SEED, DEFAULT) for one in overrides))
    between = f"They differ in {listed(varied)}. " if varied else ""
    return (
        f"{len(records)} runs were made: {names}. {between}The seeds are {listed(seeds)}. Intervals are of 95 %: of "
        "medians by order statistics (Thompson 1936), of interquartile means by Tukey and McLaughlin (1963), of means "
        f"by the bootstrap-t with {RESAMPLES} resamples (Hall 1988), of counted successes exact (Clopper and Pearson "
        "1934)."
    )


def export_report(
    records: Sequence[Mapping[str, Any]], folder: Path, home: Path, width_mm: float | None = None
) -> list[Path]:
    """Write figures, tables, methods and a README of one run, or of several beside each other, into ``folder``.

    ``home`` holds the runs; ``width_mm`` is the width of every figure. Returns the files.
    """
    source = f"{_named(records)}, kendama {__version__}"
    files = Files(source, str(records[0]["run"]) if len(records) == 1 else _named(records), width_mm)
    logs = {str(record["run"]): logs_of(record) for record in records}
    with made_for(files):
        if len(records) == 1:
            make_report(records[0], logs[str(records[0]["run"])])
        else:
            make_sweep_report("", [(record, logs[str(record["run"])]) for record in records])
    _metrics(files, records)
    facts = _facts(files, records, logs)
    made = {**files.made, "methods.md": methods_text(records, facts).encode()}
    names = sorted(name for name in files.shown if f"{name}.tex" in made)
    made["all.tex"] = latex_document(source, names).encode()
    made["README.txt"] = readme_text(source, records, _results(Store(home), records), _listed(files)).encode()
    with durable.plain_disk_errors(folder):
        folder.mkdir(parents=True, exist_ok=True)
    for name, content in made.items():
        durable.write_file((folder / name).absolute(), content)
    return [folder / name for name in sorted(made)]


def _named(records: Sequence[Mapping[str, Any]]) -> str:
    """Return a few words for the runs: their sweep, else their ids."""
    ids = [str(record["run"]) for record in records]
    sweeps = {record.get("sweep") for record in records}
    if len(ids) == 1:
        made = " ".join(records[0]["overrides"])
        return f"run {ids[0]} of {records[0]['pipeline']}{f' ({made})' if made else ''}"
    span = f"{len(ids)} runs {ids[0]} to {ids[-1]}"
    return f"sweep {sweeps.pop()}, {span}" if len(sweeps) == 1 and None not in sweeps else span


def _metrics(files: Files, records: Sequence[Mapping[str, Any]]) -> None:
    """Make the tables of metrics: of one run a table a stage, of several a row a run with what differs and the seed."""
    overrides = [overrides_of(record) for record in records]
    if len(records) == 1:
        for stage in records[0]["stages"]:
            files.metrics(str(stage["name"]), stage["metrics"], overrides[0].get(SEED, DEFAULT))
        return
    keys = [*differing(overrides), SEED]
    told = [
        {key: value for one in record["stages"] for key, value in flat(str(one["name"]), one["metrics"]).items()}
        for record in records
    ]
    names = list(dict.fromkeys(name for metrics in told for name in metrics))
    rows = [
        (
            *(made.get(key, DEFAULT) for key in keys),
            record["run"],
            record["outcome"],
            *(one.get(name) for name in names),
        )
        for record, made, one in zip(records, overrides, told, strict=True)
    ]
    files.listing("runs", "Metrics of every run", (*keys, "id", "outcome", *names), rows)


def _facts(
    files: Files, records: Sequence[Mapping[str, Any]], logs: Mapping[str, Mapping[str, Path]]
) -> dict[str, list[Facts]]:
    """Return settings and metrics of each stage, read from each log once; ``settings.csv`` lists the settings."""
    facts: dict[str, list[Facts]] = {}
    rows: list[tuple[Any, ...]] = []
    read: dict[Path, Facts] = {}
    for record in records:
        for stage, path in logs[str(record["run"])].items():
            if path not in read:
                log = StageLog(path, ())
                read[path] = Facts(log.settings, log.metrics)
            facts.setdefault(stage, []).append(read[path])
            settings = {
                key: one for node, value in read[path].settings.items() for key, one in flat(node, value).items()
            }
            rows += [(record["run"], stage, key, value) for key, value in settings.items()]
    files.listing("settings", "Settings of every stage of every run", ("id", "stage", "setting", "value"), rows)
    return facts


def _results(store: Store, records: Sequence[Mapping[str, Any]]) -> list[Result]:
    """Return the distinct results of the runs."""
    owners: dict[tuple[str, str], list[str]] = {}
    stages: dict[tuple[str, str], Mapping[str, Any]] = {}
    for record in records:
        for stage in record["stages"]:
            at = str(stage["name"]), str(stage["key"])
            owners.setdefault(at, []).append(str(record["run"]))
            stages[at] = stage
    found = []
    for (name, key), stage in stages.items():
        parts = stage_parts(store, stage)
        code = durable.sha256(durable.canonical_json(parts["code"]))[:16] if "code" in parts else "not stored any more"
        path = flat("path", parts.get("config", {}).get("capture", {}).get("path")).get("path", "")
        artifact = str(stage["artifact"]).rpartition("/")[2] if stage["artifact"] else "none"
        found.append(Result(name, tuple(owners[name, key]), key, artifact, code, str(path)))
    return found


def _listed(files: Files) -> dict[str, tuple[str, str, list[str]]]:
    shown = {}
    for name, caption in files.shown.items():
        kinds = [kind for kind in ("svg", "pdf", "png", "csv", "txt", "tex") if f"{name}.{kind}" in files.made]
        shown[name] = (files.stage_of.get(name, ""), caption, kinds)
    return shown


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
