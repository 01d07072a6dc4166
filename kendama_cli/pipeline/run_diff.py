"""Differences between two past runs: configuration, code, versions, artifacts, metrics."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from kendama_cli.pipeline.run_facts import flat, stage_parts
from kendama_cli.store.store import Store

INTERVAL = ("_low", "_high")
"""Metrics whose names end so bound the metric without that ending."""


def run_differences(store: Store, before: Mapping[str, Any], after: Mapping[str, Any]) -> dict[str, Any]:
    """Return the document of ``kendama diff``: the values of two records that differ.

    ``metrics`` holds every metric that differs, as ``[before, after]``; ``intervals`` those that have bounds, and
    whether the bounds overlap; ``artifacts`` says of every stage of either whether it gave the same bytes.
    """
    stages = [{str(stage["name"]): stage for stage in one["stages"]} for one in (before, after)]
    parts = [{name: stage_parts(store, stage) for name, stage in one.items()} for one in stages]
    names = list(dict.fromkeys([*stages[0], *stages[1]]))
    configs = [_flat_all({name: made.get("config", {}) for name, made in one.items()}) for one in parts]
    metrics = [
        {key: value for name, stage in one.items() for key, value in flat(name, stage["metrics"]).items()}
        for one in stages
    ]
    return {
        "runs": [before["run"], after["run"]],
        "config": _different(*configs),
        "code": [
            name
            for name in names
            if all(one.get(name) for one in parts) and parts[0][name].get("code") != parts[1][name].get("code")
        ],
        "versions": _different(before.get("versions", {}), after.get("versions", {})),
        "artifacts": {name: _artifact(stages[0].get(name), stages[1].get(name)) for name in names},
        "metrics": _different(*metrics),
        "intervals": _intervals(*metrics),
    }


def group_differences(before: Sequence[Mapping[str, Any]], after: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """Return the differences between two groups of runs: their overrides, and each metric's mean and interval.

    ``overrides`` holds the values of each key that differ between the groups; ``intervals`` every metric that has an
    interval in both, and whether the intervals overlap.
    """
    from kendama_cli.report.run_table import RunFacts, estimate  # noqa: PLC0415 - numpy, for groups alone

    groups = [[RunFacts.of(record) for record in one] for one in (before, after)]
    values = [_values(one) for one in groups]
    names = list(dict.fromkeys(name for one in groups for run in one for name in run.metrics))
    intervals = {}
    for name in names:
        found = [one.mean or one for group in groups if (one := estimate(group, name)) is not None]
        bounds = [[one.low, one.high] for one in found if one.low is not None and one.high is not None]
        if len(bounds) == len(groups):
            intervals[name] = _compared([one.value for one in found], bounds)
    return {
        "runs": [[one.run for one in group] for group in groups],
        "counts": [len(one) for one in groups],
        "overrides": _different(*values),
        "intervals": intervals,
    }


def _values(runs: Sequence[Any]) -> dict[str, str]:
    keys = dict.fromkeys(key for one in runs for key in one.overrides)
    return {key: ", ".join(dict.fromkeys(one.overrides.get(key, "-") for one in runs)) for key in keys}


def _flat_all(configs: Mapping[str, Mapping[str, Any]]) -> dict[str, Any]:
    """Return the settings by dotted keys; stages that read one node read the same."""
    return {
        key: value
        for config in configs.values()
        for node, inner in config.items()
        for key, value in flat(node, inner).items()
    }


def _different(before: Mapping[str, Any], after: Mapping[str, Any]) -> dict[str, list[Any]]:
    keys = dict.fromkeys([*before, *after])
    return {key: [before.get(key), after.get(key)] for key in keys if before.get(key) != after.get(key)}


def _artifact(before: Mapping[str, Any] | None, after: Mapping[str, Any] | None) -> str:
    if before is None or after is None:
        return "only in the first" if after is None else "only in the second"
    digests = [str(one["artifact"]).rpartition("/")[2] if one["artifact"] else None for one in (before, after)]
    if None in digests:
        return "not made by both"
    return "the same" if digests[0] == digests[1] else "differs"


def _intervals(before: Mapping[str, Any], after: Mapping[str, Any]) -> dict[str, dict[str, Any]]:
    """Return the metrics that both have with bounds: value and bounds of each, and whether the bounds overlap."""
    found = {}
    for key in before:
        if before[key] == after.get(key, before[key]) or any(
            key + end not in one for end in INTERVAL for one in (before, after)
        ):
            continue
        bounds = [[float(one[key + end]) for end in INTERVAL] for one in (before, after)]
        found[key] = _compared([before[key], after[key]], bounds)
    return found


def _compared(values: list[Any], bounds: list[list[float]]) -> dict[str, Any]:
    """Return two values with their intervals, and whether the intervals overlap."""
    overlap = bounds[0][0] <= bounds[1][1] and bounds[1][0] <= bounds[0][1]
    return {"values": values, "bounds": bounds, "overlap": overlap}
