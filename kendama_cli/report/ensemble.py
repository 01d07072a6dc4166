"""Several runs as groups of seeds: which overrides distinguish them, and the logs of one stage over all of them."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from kendama_cli.artifacts.proportion import success_interval
from kendama_cli.report.grid import Cell
from kendama_cli.report.intervals import Between, rate_interval
from kendama_cli.report.run_table import DEFAULT as _DEFAULT
from kendama_cli.report.run_table import SEED as _SEED
from kendama_cli.report.run_table import differing as _differing
from kendama_cli.report.run_table import overrides_of
from kendama_cli.report.source import StageLog
from kendama_cli.report.tracks import Array

Run = tuple[Mapping[str, Any], Mapping[str, Path]]
"""A run's document (``run``, ``pipeline``, ``overrides``, ``stages``) and its logs by stage."""


@dataclass(frozen=True)
class Member:
    """One distinct log, with the seed of the runs that have it."""

    seed: str
    log: StageLog

    def figure(self, metric: str) -> float | None:
        """Return a metric as a number; None where the log has none."""
        value = self.log.metrics.get(metric)
        return float(value) if isinstance(value, int | float) else None


@dataclass(frozen=True)
class Group:
    """All members whose runs were made with the same overrides but for the seed.

    ``label`` stands where the override's name does beside it, ``legend`` where it stands alone.
    """

    label: str
    members: tuple[Member, ...]
    legend: str
    settings: Mapping[str, str] = field(default_factory=dict)
    """Values of the overrides that distinguish the groups."""

    def cell(self, note: str = "") -> Cell:
        """Return the first cell of the group's row in a table."""
        seeds = " ".join(member.seed for member in self.members if member.seed) or _DEFAULT
        return Cell(self.label, note, settings={**self.settings, "seeds": seeds})

    def figures(self, metric: str) -> Array:
        """Return the metric of every member that has it, in order."""
        found = (member.figure(metric) for member in self.members)
        return np.array([value for value in found if value is not None])

    def rate_between(self, metric: str, played: Array, planned: int) -> Between | None:
        """Return the interval of a mean rate; of one member its own.

        Where each member ``played`` (n,) as many trials as ``planned`` it is the exact one of all of them together.
        """
        rates, ends = self.figures(metric), [self.members[0].figure(f"{metric}_{end}") for end in ("low", "high")]
        if len(self.members) == 1 and ends[0] is not None and ends[1] is not None:
            return ends[0], ends[1]
        if not planned or not (played == planned).all():
            return rate_interval(rates)
        return success_interval(round(float(rates.sum()) * planned), planned * len(rates))


@dataclass(frozen=True)
class Ensemble:
    """A stage's logs over all runs; ``differs`` names the overrides that distinguish the groups."""

    differs: str
    groups: tuple[Group, ...]
    failed: tuple[str, ...]
    """Runs in which the stage did not end, in words."""

    @property
    def members(self) -> int:
        """Return how many distinct logs there are."""
        return sum(len(group.members) for group in self.groups)


def ensemble(runs: Sequence[Run], stage: str, topics: Collection[str]) -> Ensemble:
    """Return the logs of ``stage`` in groups, in the order of ``runs``; only ``topics`` are kept in memory.

    A log that several runs share counts once, under the overrides on which those runs agree. Raises InputError for a
    log that cannot be read.
    """
    sharing: dict[Path, list[Run]] = {}
    for run in runs:
        if stage in run[1]:
            sharing.setdefault(run[1][stage], []).append(run)
    failed = []
    for document, logs in runs:
        entries = [entry for entry in document.get("stages", ()) if entry.get("name") == stage]
        if stage not in logs and entries:
            failed.append(_sentence(document, str(entries[0].get("status", "")), entries[0].get("error")))
    common = {path: _common(overrides_of(document) for document, _ in owners) for path, owners in sharing.items()}
    differing = _differing(list(common.values()))
    members: dict[str, list[Member]] = {}
    settings: dict[str, dict[str, str]] = {}
    for path, values in common.items():
        label = _label(values, differing)
        settings[label] = {name: values.get(name, _DEFAULT) for name in differing}
        members.setdefault(label, []).append(Member(values.get(_SEED, ""), StageLog(path, topics)))
    named = f"{differing[0]}=" if len(differing) == 1 else ""
    groups = tuple(
        Group(label, tuple(found), label if label == _DEFAULT else named + label, settings[label])
        for label, found in members.items()
    )
    return Ensemble(", ".join(differing), groups, tuple(failed))


def _common(overrides: Iterable[Mapping[str, str]]) -> dict[str, str]:
    first, *others = overrides
    return {name: value for name, value in first.items() if all(other.get(name) == value for other in others)}


def _label(values: Mapping[str, str], differing: Sequence[str]) -> str:
    if not differing:
        return "all runs"
    if len(differing) == 1:
        return values.get(differing[0], _DEFAULT)
    return ", ".join(f"{name}={values[name]}" for name in differing if name in values) or _DEFAULT


def _sentence(document: Mapping[str, Any], status: str, error: Any) -> str:
    made = " ".join(map(str, document.get("overrides", ()))) or str(document.get("run", "a run"))
    return f"{made}: {error or status or 'did not end'}"
