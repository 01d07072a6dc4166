"""Table of learners in environments of others in docs/results/data, from the settings and seeds of ``bench.yaml``.

``python -m tests.plugins.bench.rows`` measures the seeds that are not yet in ``bench_seeds.csv``, adds them there, and
writes the table; names of environments limit it. The ball needs MuJoCo and the files of dm_control.
"""

from __future__ import annotations

import csv
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from kendama_cli.config.compose import composed
from kendama_cli.config.site import find_site
from kendama_cli.pipeline.nodes import build_settings
from kendama_cli.plugins.bench.settings import BenchSettings
from kendama_cli.plugins.bench.stage import Bench
from kendama_cli.report.intervals import mean_interval
from tests.benchmarks.learning import DATA, SilentContext

ROWS, SEEDS = (Path(__file__).with_name(name) for name in ("bench.yaml", "bench_seeds.csv"))
DOCUMENT = yaml.safe_load(ROWS.read_text())
METRICS = "frozen_return", "replayed_return", "random_return", "gain", "steps"
HEAD = ("environment", "seed", *METRICS)
TABLE_HEAD = (
    *("environment", "seeds", "frozen policy", "replayed harmonic", "random", "gain", "gain above 0", "published"),
)
FEWEST = 6
"""Fewer seeds tell no interval."""


def settings_of(environment: str) -> BenchSettings:
    """Return the settings of the stage for ``environment``."""
    own = DOCUMENT["environments"][environment].get("settings", [])
    overrides = [f"bench.environment={environment}", *own]
    found: BenchSettings = build_settings(composed(find_site(), overrides))["bench"]
    return found


def table_learned(environment: str, seed: int) -> dict[str, Any]:
    """Return the metrics of the stage ``bench`` with ``seed``."""
    return dict(Bench(bench=settings_of(environment)).run({}, SilentContext(seed)).metrics)  # type: ignore[arg-type]


def read() -> list[dict[str, Any]]:
    """Return the lines of the file of seeds."""
    if not SEEDS.exists():
        return []
    with SEEDS.open(newline="") as file:
        return [
            {key: value if key == "environment" else float(value) for key, value in line.items()}
            for line in csv.DictReader(file)
        ]


def cells(environment: str, lines: Sequence[Mapping[str, Any]]) -> list[str]:
    """Return the row of docs that the ``lines`` of an environment make."""
    frozen, replayed, random, gain = (np.array([line[name] for line in lines]) for name in METRICS[:4])
    low, high = DOCUMENT["environments"][environment]["returns"]
    return [
        environment.removeprefix("dm_control/").removesuffix("-v0") if "/" in environment else environment,
        f"{int(lines[0]['seed'])} to {int(lines[-1]['seed'])}",
        *(_with(values, low, high) for values in (frozen, replayed)),
        f"{random.mean():.0f}",
        _with(gain),
        f"{int((gain > 0.0).sum())} of {len(gain)}",
        str(DOCUMENT["environments"][environment]["published"]),
    ]


def _with(values: Any, low: float = -np.inf, high: float = np.inf) -> str:
    between = mean_interval(values) if len(values) >= FEWEST else None
    ends = "" if between is None else " [{:.0f}, {:.0f}]".format(*np.clip(between, low, high))
    return f"{values.mean():.0f}{ends}"


def table(lines: Sequence[Mapping[str, Any]]) -> list[list[str]]:
    """Return the table of docs, its head first."""
    found = ((name, [line for line in lines if line["environment"] == name]) for name in DOCUMENT["environments"])
    return [list(TABLE_HEAD), *(cells(name, own) for name, own in found if own)]


def keep(lines: Sequence[Mapping[str, Any]]) -> list[Mapping[str, Any]]:
    """Write the file of seeds; return its lines in the order of the environments."""
    order = list(DOCUMENT["environments"])
    kept = sorted(lines, key=lambda line: (order.index(line["environment"]), line["seed"]))
    with SEEDS.open("w", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(HEAD)
        writer.writerows([line["environment"], *(f"{line[key]:.10g}" for key in HEAD[1:])] for line in kept)
    return kept


def write(lines: Sequence[Mapping[str, Any]]) -> None:
    """Write the file of seeds and the table of docs."""
    with (DATA / "bench.csv").open("w", newline="") as file:
        csv.writer(file, lineterminator="\n").writerows(table(keep(lines)))


def main(words: Sequence[str]) -> None:
    """Measure what is missing."""
    lines = read()
    for environment in words or DOCUMENT["environments"]:
        known = {line["seed"] for line in lines if line["environment"] == environment}
        for seed in range(DOCUMENT["from"], DOCUMENT["from"] + DOCUMENT["environments"][environment]["seeds"]):
            if seed in known:
                continue
            found = table_learned(environment, seed)
            lines.append({"environment": environment, "seed": seed, **{name: found[name] for name in METRICS}})
            keep(lines)  # a seed that was measured is never lost
            print(lines[-1], flush=True)
    write(lines)


if __name__ == "__main__":
    main(sys.argv[1:])
