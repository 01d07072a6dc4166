"""Compare a learner with its own exploration over environments and seeds, with 95 % intervals."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from kendama_cli.cli import render
from kendama_cli.plugins.bench.learn_on import learn_on
from kendama_cli.report.intervals import mean_interval

COLUMNS = ("frozen_return", "replayed_return", "random_return", "gain")


def compare(
    environments: Sequence[str],
    learner: str,
    seeds: Sequence[int],
    overrides: Sequence[str],
    *,
    home: Path | None,
    as_json: bool,
) -> None:
    """Learn on every environment with every seed, and print means over the seeds; what is cached is not learned."""
    found = []
    for environment in environments:
        runs = []
        for seed in seeds:
            metrics = learn_on(environment, learner=learner, seed=seed, overrides=overrides, home=home).metrics
            runs.append(metrics)
            render.note(f"{environment} seed {seed}: {render.figures({name: metrics[name] for name in COLUMNS})}")
        found.append(_row(environment, runs))
    if as_json:
        render.document(found)
        return
    head = ("environment", "seeds", *(name.replace("_", " ") for name in COLUMNS))
    render.table(
        [[str(one["environment"]), str(one["seeds"]), *map(_cell, COLUMNS, [one] * 4)] for one in found], head=head
    )


def _row(environment: str, runs: Sequence[Any]) -> dict[str, Any]:
    row: dict[str, Any] = {"environment": environment, "seeds": len(runs)}
    for name in COLUMNS:
        values = np.array([one[name] for one in runs if one[name] is not None], dtype=np.float64)
        row[name] = float(values.mean()) if len(values) else None
        row[f"{name}_interval"] = mean_interval(values) if len(values) > 1 else None
    return row


def _cell(name: str, row: dict[str, Any]) -> str:
    mean, between = row[name], row[f"{name}_interval"]
    if mean is None:
        return ""
    return f"{mean:.4g}" if between is None else f"{mean:.4g} [{between[0]:.4g}, {between[1]:.4g}]"
