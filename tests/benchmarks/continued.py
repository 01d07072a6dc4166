"""Continued learning on twins that the model does not know: the same tables before and after, frozen.

``python -m tests.benchmarks.continued [HARDWARE...]`` learns a table of ``hard`` a seed on the rail, and lets it
continue as ``transfer=until_solved`` does, on the quick twin of each HARDWARE (``tests/control/quick_twin.py``: no arm,
no images). It plays the table frozen before and after. It measures the tables that are not yet in
``continued_seeds.csv``, adds them, and writes docs/results/data/continued_learning.csv.
"""

from __future__ import annotations

import csv
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, cast

import numpy as np

import kendama_cli as kendama
from kendama_cli.artifacts.policy import PolicyArtifact
from kendama_cli.artifacts.proportion import success_interval
from kendama_cli.control.catch_controller import make_catch_geometry
from kendama_cli.control.game_runner import GameRunner
from kendama_cli.learning.learners import make_policy
from kendama_cli.report.intervals import quantile_interval
from kendama_cli.stages.learn.stage import Learn
from kendama_cli.stages.transfer.progress import Progress
from tests.benchmarks.learning import DATA, SilentContext
from tests.control.cart_robot import DIRECTION, MIDDLE_M, Straight
from tests.control.quick_twin import QuickTwin

SEEDS = Path(__file__).with_name("continued_seeds.csv")
TWINS = "beyond_drag", "beyond_tie_friction"
FIRST, COUNT, ROLLOUTS = 98000, 20, 20
OVERRIDES = "simulation/engine=rail", "transfer=until_solved", "transfer.max_rollouts=200", "transfer.thorough=true"
METRICS = "before", "after", "solved", "rollouts_to_solved"
GOOD = 0.9
"""A table is good whose frozen rollouts succeed so often: in 18 of the 20."""
TABLE_HEAD = (
    *("twin", "tables", "good before", "good after", "mean success before / after", "worse by a tenth after"),
    *("solved", "rollouts to solved, median"),
)


def measured(hardware: str, seed: int) -> dict[str, Any]:
    """Return rates of success of one table before and after learning on, and its rollouts to solved."""
    made = kendama.configuration([*OVERRIDES, f"hardware={hardware}"])
    learn, game, transfer = made["learn"], made["game"], made["transfer"]
    ctx = cast("Any", SilentContext(seed))
    table = Learn(learn=learn, game=game).run({}, ctx).artifact
    twin = QuickTwin(game, made["hardware"].imperfection)
    scale = made["hardware"].imperfection.rope_scale  # the builder of games measures the hanging ball
    geometry = make_catch_geometry(MIDDLE_M, DIRECTION, game, transfer.catch, rope_scale=scale, period_s=twin.period_s)
    runner = GameRunner(
        cast("Any", twin),
        Straight(),
        geometry=geometry,
        observer=cast("Any", None),  # of the flight, which is not played
        game=game,
        learn=learn,
        settings=transfer,
    )
    progress = Progress.resumed(None, table, learn, transfer, ctx.rng("transfer"))

    def rate(policy: PolicyArtifact, name: str) -> float:
        seeds = [int(progress.rng(name, k).integers(2**63)) for k in range(ROLLOUTS)]
        swings = [runner.swing_up(make_policy(policy, learn), seed=one) for one in seeds]
        return float(np.mean([swing.outcome == "goal" for swing in swings]))

    before = rate(table, "before")
    while not progress.frozen("table"):
        learner = progress.learner()
        rng = progress.rng("learn", learner.count.rollouts)
        learner.begin_rollout(rng)
        swing = runner.swing_up(learner, seed=int(rng.integers(2**63)))
        learner.end_rollout(swing.outcome, swing.last)
        progress.keep(learner)
    after = rate(progress.policy, "after")
    return dict(zip(METRICS, (before, after, bool(progress.solved()), progress.rollouts_to_solved()), strict=True))


def read() -> list[dict[str, Any]]:
    """Return the lines of the file of seeds."""
    if not SEEDS.exists():
        return []
    with SEEDS.open(newline="") as file:
        lines = csv.DictReader(file)
        return [{key: one if key == "twin" else float(one) for key, one in line.items()} for line in lines]


def cells(twin: str, lines: Sequence[Mapping[str, Any]]) -> list[str]:
    """Return the row of docs that ``lines`` make."""
    before, after, solved, rollouts = (np.array([line[name] for line in lines]) for name in METRICS)
    between = quantile_interval(rollouts)
    return [
        f"`{twin}`",
        f"{int(lines[0]['seed'])} to {int(lines[-1]['seed'])}",
        *(_of(values >= GOOD) for values in (before, after)),
        f"{before.mean():.2f} / {after.mean():.2f}",
        str(int((after < before - 0.1).sum())),
        _of(solved),
        f"{np.median(rollouts):.0f}" + ("" if between is None else f" [{between[0]:.0f}, {between[1]:.0f}]"),
    ]


def _of(flags: Any) -> str:
    wins = success_interval(int(flags.sum()), len(flags))
    return f"{int(flags.sum())} of {len(flags)} [{wins.low:.2f}, {wins.high:.2f}]"


def table(lines: Sequence[Mapping[str, Any]]) -> list[list[str]]:
    """Return the table of docs, its head first."""
    found = ((twin, [line for line in lines if line["twin"] == twin]) for twin in TWINS)
    return [list(TABLE_HEAD), *(cells(twin, own) for twin, own in found if own)]


def keep(lines: Sequence[Mapping[str, Any]]) -> list[Mapping[str, Any]]:
    """Write the file of seeds; return its lines in the order of the table."""
    kept = sorted(lines, key=lambda line: (TWINS.index(line["twin"]), line["seed"]))
    with SEEDS.open("w", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(("twin", "seed", *METRICS))
        writer.writerows([line["twin"], *(f"{line[key]:g}" for key in ("seed", *METRICS))] for line in kept)
    return kept


def write(lines: Sequence[Mapping[str, Any]]) -> None:
    """Write the file of seeds and the table of docs."""
    with (DATA / "continued_learning.csv").open("w", newline="") as file:
        csv.writer(file, lineterminator="\n").writerows(table(keep(lines)))


def main(words: Sequence[str]) -> None:
    """Measure what is missing, a table of each twin in turn."""
    lines = read()
    for seed in range(FIRST, FIRST + COUNT):
        for twin in words or TWINS:
            if (twin, seed) in {(line["twin"], line["seed"]) for line in lines}:
                continue
            found = {"twin": twin, "seed": seed, **measured(twin, seed)}
            lines.append(found)
            keep(lines)  # a table that was measured is never lost
            print(found, flush=True)
    write(lines)


if __name__ == "__main__":
    main(sys.argv[1:])
