"""Tables of learning in docs/results/data, remade from the settings and seeds that ``learning.yaml`` names.

``python -m tests.benchmarks.learning`` measures the rows that have no seeds in ``learning_seeds.csv`` yet, adds them
there, and writes the tables; ``--all`` measures every row anew, and names of tables limit both. A seed takes about a
second, one of a deep agent minutes: it needs ``pip install examples/agents stable-baselines3``.
"""

from __future__ import annotations

import csv
import sys
import zlib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from kendama_cli.config.compose import composed
from kendama_cli.config.site import Site, find_site
from kendama_cli.pipeline.nodes import build_settings
from kendama_cli.report.intervals import (
    improvement,
    interquartile_interval,
    interquartile_mean,
    mean_interval,
    quantile_interval,
    rate_interval,
)
from kendama_cli.stages.learn.stage import Learn

ROWS, SEEDS = (Path(__file__).with_name(name) for name in ("learning.yaml", "learning_seeds.csv"))
DATA = Path(__file__).parents[2] / "docs" / "results" / "data"
METRICS = (
    "learned",
    "rollouts_to_learned",
    "solved",
    "rollouts_to_solved",
    "frozen_visual_caught_rate",
    "frozen_caught_rate",
)
CAP = 1000.0
HEAD = ("table", "row", "seed", *METRICS)


@dataclass(frozen=True)
class Row:
    """One row of a table: its name, overrides of the configuration, and seeds."""

    table: str
    name: str
    overrides: tuple[str, ...]
    seeds: range


def rows() -> Iterator[Row]:
    """Yield the rows that the file names, in its order."""
    document = yaml.safe_load(ROWS.read_text())
    for table, entry in document["tables"].items():
        for name, (count, *overrides) in entry["rows"].items():
            flat = [text for one in overrides for text in (one if isinstance(one, list) else [one])]
            seeds = range(entry["from"], entry["from"] + count)
            yield Row(table, name, (*document["always"], *entry["all"], *flat), seeds)


class SilentContext:
    """A StageContext that keeps nothing; its random streams are those of a worker with this seed."""

    def __init__(self, seed: int) -> None:
        self._seed, self.log = seed, self
        self._streams: dict[str, np.random.Generator] = {}

    def rng(self, purpose: str) -> np.random.Generator:
        return self._streams.setdefault(purpose, np.random.default_rng([self._seed, zlib.crc32(purpose.encode())]))

    def write(self, topic: str, t_s: float, message: object) -> None: ...

    def restore(self) -> None: ...

    def checkpoint(self, state: object, *, force: bool = False) -> None: ...

    def progress(self, done: int, total: int | None, **figures: object) -> None: ...


def measured(row: Row, seeds: Sequence[int], site: Site) -> Iterator[dict[str, Any]]:
    """Yield the metrics of ``seeds``, one line of the file of seeds each."""
    settings = build_settings(composed(site, list(row.overrides)))
    stage = Learn(learn=settings["learn"], game=settings["game"])
    for seed in seeds:
        metrics = stage.run({}, SilentContext(seed)).metrics  # type: ignore[arg-type]
        told = {name: int(value) if isinstance(value := metrics[name], bool) else value for name in METRICS}
        yield {"table": row.table, "row": row.name, "seed": seed, **told}


def read() -> list[dict[str, Any]]:
    """Return the lines of the file of seeds."""
    if not SEEDS.exists():
        return []
    with SEEDS.open(newline="") as file:
        return [
            {key: value if key in ("table", "row") else float(value or "nan") for key, value in line.items()}
            for line in csv.DictReader(file)
        ]


def summary(lines: Sequence[Mapping[str, Any]], reference: Sequence[Mapping[str, Any]]) -> list[str]:
    """Return the cells of a row of docs, beside those of the table's first row."""
    solved, learned, caught = (
        np.array([line[name] for line in lines])
        for name in ("rollouts_to_solved", "rollouts_to_learned", "frozen_caught_rate")
    )
    unsolved = int(sum(not line["solved"] for line in lines))
    sooner, between = improvement(solved, np.array([line["rollouts_to_solved"] for line in reference]))
    first, last = int(lines[0]["seed"]), int(lines[-1]["seed"])
    cap = max(CAP, solved.max())  # the rollouts that validate an agent of another library come on top
    mean = _with(solved.mean(), _counts(mean_interval(solved), cap))
    return [
        f"{first} to {last}",
        _with(np.median(learned), quantile_interval(learned)),
        _with(np.median(solved), quantile_interval(solved)),
        _with(float(interquartile_mean(solved)), _counts(interquartile_interval(solved), cap)),
        f"{mean}, restricted" if unsolved else mean,
        str(unsolved) if unsolved else "none",
        f"{_with(caught.mean(), rate_interval(caught), 3)} / {caught.min():.3g}",
        "" if lines is reference else _with(sooner, between, 2),
    ]


TABLE_HEAD = (
    *("row", "seeds", "ten in a row, median", "solved, median", "interquartile mean", "mean", "unsolved"),
    *("frozen: caught, mean / worst", "solved sooner than the first row"),
)


def _counts(between: tuple[float, float] | None, cap: float) -> tuple[float, float] | None:
    """Return an interval of rollouts without what lies below none or beyond the cap: few seeds do not know either."""
    return None if between is None else (max(0.0, between[0]), min(cap, between[1]))


def _with(value: float, between: tuple[float, float] | None, digits: int = 0) -> str:
    low_high = "" if between is None else f" [{between[0]:.{digits}f}, {between[1]:.{digits}f}]"
    return f"{value:.{digits}f}{low_high}"


def tables(lines: Sequence[Mapping[str, Any]]) -> dict[str, list[list[str]]]:
    """Return the tables of docs by name, heads first, of the rows that have been measured."""
    made: dict[str, list[list[str]]] = {}
    by_row: dict[tuple[str, str], list[Mapping[str, Any]]] = {}
    for line in lines:
        by_row.setdefault((line["table"], line["row"]), []).append(line)
    references: dict[str, Sequence[Mapping[str, Any]]] = {}
    for row in rows():
        found = by_row.get((row.table, row.name))
        if found:
            reference = references.setdefault(row.table, found)
            made.setdefault(row.table, [list(TABLE_HEAD)]).append([row.name, *summary(found, reference)])
    return made


def keep(lines: Sequence[Mapping[str, Any]]) -> list[Mapping[str, Any]]:
    """Write the file of seeds; return its lines in the order of the rows."""
    order = {(row.table, row.name): place for place, row in enumerate(rows())}
    kept = sorted(
        (line for line in lines if (line["table"], line["row"]) in order),
        key=lambda line: (order[line["table"], line["row"]], line["seed"]),
    )
    with SEEDS.open("w", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(HEAD)
        for line in kept:
            writer.writerow(f"{line[key]:g}" if isinstance(line[key], float) else line[key] for key in HEAD)
    return kept


def write(lines: Sequence[Mapping[str, Any]]) -> None:
    """Write the file of seeds and the tables of docs."""
    for name, cells in tables(keep(lines)).items():
        with (DATA / f"{name}.csv").open("w", newline="") as file:
            csv.writer(file, lineterminator="\n").writerows(cells)


def main(words: Sequence[str]) -> None:
    """Measure what is missing, or all of it."""
    site, anew, chosen = find_site(), "--all" in words, [word for word in words if not word.startswith("-")]
    lines = read()
    for row in rows():
        if chosen and row.table not in chosen:
            continue
        known = {line["seed"] for line in lines if (line["table"], line["row"]) == (row.table, row.name)}
        seeds = [seed for seed in row.seeds if anew or seed not in known]
        if not seeds:
            continue
        mine = {(row.table, row.name, float(seed)) for seed in seeds}
        lines = [line for line in lines if (line["table"], line["row"], float(line["seed"])) not in mine]
        for line in measured(row, seeds, site):
            lines.append(line)
            keep(lines)  # a seed that was measured is never lost
        print(row.table, row.name, len(seeds), flush=True)
    write(lines)


if __name__ == "__main__":
    main(sys.argv[1:])
