"""Sentences of a paper's method section, from the declarations of the stages and the values of the runs alone."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from kendama_cli.report.chapters import declaration_of
from kendama_cli.report.intervals import RESAMPLES
from kendama_cli.report.run_table import DEFAULT, SEED, differing, overrides_of
from kendama_cli.report.tables import label_and_unit, number

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
