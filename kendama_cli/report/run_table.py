"""Runs in rows of equal overrides but for the seed, each metric with its median, mean and intervals over the runs."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from kendama_cli.artifacts.proportion import success_interval
from kendama_cli.report.intervals import mean_interval, quantile_interval, rate_interval
from kendama_cli.schema.declaration import find_stage

SEED = "seed"
DEFAULT = "as configured"


@dataclass(frozen=True)
class RunFacts:
    """One run: ``metrics`` by ``stage.metric``, and the artifact that each stage's metrics come from."""

    run: str
    overrides: Mapping[str, str]
    metrics: Mapping[str, Any]
    artifacts: Mapping[str, Any]

    @staticmethod
    def of(record: Mapping[str, Any]) -> RunFacts:
        """Return the facts of a run's record; a stage that ended has metrics."""
        stages = {str(one["name"]): one for one in record["stages"]}
        metrics = {f"{name}.{key}": value for name, one in stages.items() for key, value in one["metrics"].items()}
        artifacts = {name: one["artifact"] for name, one in stages.items()}
        return RunFacts(str(record["run"]), overrides_of(record), metrics, artifacts)


@dataclass(frozen=True)
class Estimate:
    """A figure of a metric over ``n`` distinct results, and its 95 % interval where there is one.

    It is the median, of yes and no the fraction; ``mean`` is the mean of several numbers. Where ``capped`` results had
    not reached what the metric counts to, the cap stands for them: the mean is a restricted one.
    """

    value: float
    low: float | None
    high: float | None
    n: int
    mean: Estimate | None = None
    capped: int = 0

    def text(self, digits: int) -> str:
        """Return ``value [low, high]`` with ``digits`` significant digits, and the number of ``capped`` results."""
        between = f" [{rounded(self.low, digits)}, {rounded(self.high, digits)}]" if self.low is not None else ""
        return rounded(self.value, digits) + between + (f", {self.capped} at the cap" if self.capped else "")

    def texts(self, digits: int) -> str:
        """Return the text, and that of the mean where there is one."""
        return self.text(digits) + (f"; mean {self.mean.text(digits)}" if self.mean is not None else "")


@dataclass(frozen=True)
class TableRow:
    """Runs with equal overrides but for the seed."""

    settings: tuple[str, ...]
    runs: tuple[str, ...]
    seeds: tuple[str, ...]
    estimates: tuple[Estimate | None, ...]


@dataclass(frozen=True)
class RunTable:
    """Rows of runs: ``settings`` are the overrides that differ, the seed excepted."""

    settings: tuple[str, ...]
    metrics: tuple[str, ...]
    rows: tuple[TableRow, ...]


def overrides_of(record: Mapping[str, Any]) -> dict[str, str]:
    """Return the overrides of a run by their keys."""
    parts = (str(text).partition("=") for text in record.get("overrides", ()))
    return {key.lstrip("+~"): value for key, _, value in parts}


def differing(overrides: Sequence[Mapping[str, str]]) -> list[str]:
    """Return the keys whose values differ between runs, the seed excepted."""
    names = dict.fromkeys(name for one in overrides for name in one if name != SEED)
    return [name for name in names if len({one.get(name) for one in overrides}) > 1]


def run_table(runs: Sequence[RunFacts], metrics: Sequence[str]) -> RunTable:
    """Return the table of ``metrics`` over ``runs``, its rows in the order of the runs."""
    keys = differing([one.overrides for one in runs])
    rows: dict[tuple[str, ...], list[RunFacts]] = {}
    for one in runs:
        rows.setdefault(tuple(one.overrides.get(key, DEFAULT) for key in keys), []).append(one)
    return RunTable(
        tuple(keys),
        tuple(metrics),
        tuple(
            TableRow(
                settings,
                tuple(one.run for one in found),
                tuple(dict.fromkeys(one.overrides.get(SEED, DEFAULT) for one in found)),
                tuple(estimate(found, metric) for metric in metrics),
            )
            for settings, found in rows.items()
        ),
    )


def estimate(runs: Sequence[RunFacts], metric: str) -> Estimate | None:
    """Return a metric's estimate; None if no run has it as a number.

    A result that several runs share counts once. Intervals are those of ``report/intervals.py``, for yes and no the
    exact one of their count (Clopper and Pearson 1934); of one result it is the one that the stage computed,
    ``METRIC_low`` to ``METRIC_high``, if there is one.
    """
    stage, _, name = metric.partition(".")
    distinct = {one.artifacts.get(stage) or one.run: one.metrics for one in runs}
    found = [one for one in distinct.values() if _is_number(one.get(metric))]
    if not found:
        return None
    values = np.array([float(one[metric]) for one in found])
    n = len(values)
    if n == 1:
        low, high = (found[0].get(f"{metric}_{end}") for end in ("low", "high"))
        return Estimate(float(values[0]), low if _is_number(low) else None, high if _is_number(high) else None, n)
    if all(isinstance(one[metric], bool) for one in found):
        return Estimate(float(values.mean()), *success_interval(int(values.sum()), n), n)
    declaration = find_stage(stage)
    reached = f"{stage}.{declaration.capped.get(name)}" if declaration is not None else ""
    capped = sum(one.get(reached) is False for one in found)
    low, high = quantile_interval(values) or (None, None)
    interval = rate_interval if name.endswith("_rate") else mean_interval
    below, above = interval(values) or (None, None)
    mean = Estimate(float(values.mean()), below, above, n, capped=capped)
    return Estimate(float(np.median(values)), low, high, n, mean)


def rounded(value: float | None, digits: int) -> str:
    """Return a number with ``digits`` significant digits, without zeros that say nothing; empty for None."""
    if value is None:
        return ""
    if value and not 1e-4 <= abs(value) < 1e9:
        return f"{value:.{digits - 1}e}"
    return np.format_float_positional(value, precision=digits, fractional=False, trim="-")


def _is_number(value: Any) -> bool:
    return isinstance(value, bool | int | float) and math.isfinite(value)
