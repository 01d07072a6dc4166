"""Table of offline learning in docs/results/data: policies from one model alone, played in the world.

``python -m tests.plugins.offline.rows`` measures the seeds that are not yet in ``offline_seeds.csv``, adds them there,
and writes the table; names of rows limit it. Nothing was tuned on these seeds.
"""

from __future__ import annotations

import csv
import functools
import sys
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from kendama_cli.artifacts.proportion import success_interval
from kendama_cli.config.compose import composed
from kendama_cli.config.site import find_site
from kendama_cli.learning.settings import LearnSettings
from kendama_cli.pipeline.nodes import build_settings
from kendama_cli.plugins.offline.fit import Fit
from kendama_cli.plugins.offline.settings import FitSettings
from kendama_cli.plugins.offline.stage import Offline
from kendama_cli.report.intervals import rate_interval
from kendama_cli.settings.game import GameSettings
from kendama_cli.stages.interface import StageResult
from tests.benchmarks.learning import DATA, SilentContext

SEEDS = Path(__file__).with_name("offline_seeds.csv")
STRINGS_M = (0.35, 0.40, 0.45)
ROWS = {
    "identified": ("offline.model=identified",),
    "wrong": ("offline.model=wrong",),
    "world": ("offline.model=world",),
    "network, exact states": ("offline.model=network",),
    "network, tracked": ("offline.model=network", "fit.network_data=tracked"),
}
ALWAYS = ("learn/task=hard", "simulation/engine=rail", "fit.seed=97000")
FIRST, COUNT = 97000, 20
FEW = 5
METRICS = ("error_mm", "rollouts_to_solved", "model_caught_rate", "world_caught_rate", "random_success_rate")
HEAD = ("row", "string_m", "seed", *METRICS)
TABLE_HEAD = (
    *(
        "model",
        "string",
        "seeds",
        "error after a second",
        "caught in the model, mean",
        "caught in the world, mean / worst",
    ),
    "policies that catch at least half",
)


def measured(row: str, string_m: float, seeds: Sequence[int]) -> Iterator[dict[str, Any]]:
    """Yield a line of the file of seeds for each of ``seeds``; the models are fitted once."""
    settings = build_settings(composed(find_site(), [*ALWAYS, *ROWS[row], f"fit.string_m={string_m}"]))
    shared = {name: settings[name] for name in ("fit", "learn", "game")}
    fitted = _fitted(**shared)
    error = fitted.metrics.get(f"{settings['offline'].model}_error_mm", 0.0)
    for seed in seeds:
        metrics = (
            Offline(offline=settings["offline"], **shared).run({"fit": fitted.artifact}, SilentContext(seed)).metrics
        )
        found = {"error_mm": error, **metrics}
        yield {"row": row, "string_m": string_m, "seed": seed, **{name: found[name] for name in METRICS}}


@functools.cache
def _fitted(*, fit: FitSettings, learn: LearnSettings, game: GameSettings) -> StageResult:
    return Fit(fit=fit, learn=learn, game=game).run({}, SilentContext(0))


def read() -> list[dict[str, Any]]:
    """Return the lines of the file of seeds."""
    if not SEEDS.exists():
        return []
    with SEEDS.open(newline="") as file:
        lines = csv.DictReader(file)
        return [{key: one if key == "row" else float(one) for key, one in line.items()} for line in lines]


def cells(row: str, string_m: float, lines: Sequence[Mapping[str, Any]]) -> list[str]:
    """Return the row of docs that ``lines`` make."""
    model, world = (np.array([line[f"{place}_caught_rate"] for line in lines]) for place in ("model", "world"))
    half = success_interval(int((world >= 0.5).sum()), len(world))
    return [
        f"`{row}`" if "," not in row else row,
        f"{100 * string_m:.0f} cm",
        f"{int(lines[0]['seed'])} to {int(lines[-1]['seed'])}",
        f"{lines[0]['error_mm']:.1f} mm",
        _rate(model),
        f"{_rate(world)} / {world.min():.3g}",
        f"{int((world >= 0.5).sum())} of {len(world)} [{half.low:.2f}, {half.high:.2f}]",
    ]


def _rate(values: Any) -> str:
    between = rate_interval(values) if len(values) > FEW else None  # equal values of few seeds would have none
    return f"{values.mean():.3f}" + ("" if between is None else f" [{between[0]:.2f}, {between[1]:.2f}]")


def table(lines: Sequence[Mapping[str, Any]]) -> list[list[str]]:
    """Return the table of docs, its head first."""
    by_row: dict[tuple[str, float], list[Mapping[str, Any]]] = {}
    for line in lines:
        by_row.setdefault((line["row"], line["string_m"]), []).append(line)
    return [list(TABLE_HEAD), *(cells(*key, one) for key, one in by_row.items())]


def keep(lines: Sequence[Mapping[str, Any]]) -> list[Mapping[str, Any]]:
    """Write the file of seeds; return its lines in the order of the rows."""
    order = list(ROWS)
    kept = sorted(lines, key=lambda line: (order.index(line["row"]), line["string_m"], line["seed"]))
    with SEEDS.open("w", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(HEAD)
        writer.writerows([line["row"], *(f"{line[key]:.10g}" for key in HEAD[1:])] for line in kept)
    return kept


def write(lines: Sequence[Mapping[str, Any]]) -> None:
    """Write the file of seeds and the table of docs."""
    with (DATA / "offline.csv").open("w", newline="") as file:
        csv.writer(file, lineterminator="\n").writerows(table(keep(lines)))


def main(words: Sequence[str]) -> None:
    """Measure what is missing."""
    lines = read()
    for row in words or ROWS:
        for string_m in STRINGS_M:
            known = {line["seed"] for line in lines if (line["row"], line["string_m"]) == (row, string_m)}
            seeds = [seed for seed in range(FIRST, FIRST + COUNT) if seed not in known]
            for line in measured(row, string_m, seeds) if seeds else ():
                lines.append(line)
                keep(lines)  # a seed that was measured is never lost
            print(row, string_m, len(seeds), flush=True)
    write(lines)


if __name__ == "__main__":
    main(sys.argv[1:])
