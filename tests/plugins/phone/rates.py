"""Rates at which an arm catches with a bent swing, beside swings of wrong shape.

    python -m tests.plugins.phone.rates RECORDING TABLE.csv [LAST_SEED [MINUTES [KIND ...]]]

bends a person's swing (RECORDING as in ``phones.person_swing``) by smooth errors as large as those of a hand beside
motion capture: 13 and 28 mm rms after 2 and 3 s of slow motion, 43 and 90 mm of fast motion. The wrong shapes are the
swing reversed in time, at 0.6 of its size, its height alone, and with the phases of its spectrum drawn anew: alike for
all coordinates, or apart. Each row is the stage `adapt` on the PA10 under ``adapt/uncertainty=hard`` with REPEATS
repeats and the visual catch.

A row that stands in the table is left out, and after MINUTES no further one is begun. Without a KIND all are run.
At the end all rates are printed.
"""

from __future__ import annotations

import csv
import dataclasses
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np

from kendama_cli.adaptation.settings import AdaptSettings
from kendama_cli.artifacts.demonstration import Demonstration
from kendama_cli.artifacts.proportion import success_interval
from kendama_cli.errors import StageError
from kendama_cli.motion.dmp.averaging import encode_demonstrations
from kendama_cli.motion.dmp.primitive import play
from kendama_cli.schema.arrays import Array
from kendama_cli.schema.settings import build
from kendama_cli.stages.adapt.stage import Adapt
from tests.memory_context import MemoryContext
from tests.motion.swings import settings as encode_settings
from tests.plugins.phone.phones import person_swing
from tests.simulation.dart.bench_robot import adapt_values, bench_arm, kendama_game

FIRST_SEED, LAST_SEED = 41000, 41019
REPEATS = 10
COLUMNS = (
    "kind", "seed", "from_true_mm", "caught", "repeats_caught", "tau", "goal_shift_mm", "played_from_true_mm",
    "played_from_given_mm", "corrected_mm",
)  # fmt: skip


def bent(seed: int, path_m: Array, rms_m: float) -> Array:
    """Add a smooth error that grows from the start, with half of it across the swing's plane."""
    u = np.linspace(0, 1, len(path_m))
    a, b, c = np.random.default_rng(seed).normal(size=(3, 3))
    bump = 16 * u**2 * (1 - u) ** 2
    error = np.outer(3 * u**2 - 2 * u**3, a) + np.outer(bump, b) + np.outer(np.sin(2 * np.pi * u) * bump, c)
    error[:, 1] *= 0.5
    return path_m + error * rms_m / distance_m(error, 0 * error)


def other_phases(seed: int, path_m: Array, *, apart: bool) -> Array:
    """Return a path of the same spectrum whose phases are drawn anew, one for all coordinates or ``apart``."""
    n = len(path_m)
    spectrum = np.fft.rfft(path_m - np.outer(np.linspace(0, 1, n), path_m[-1]), axis=0)
    drawn = np.random.default_rng(seed).random((len(spectrum), 3 if apart else 1))
    made = np.fft.irfft(spectrum * np.exp(2j * np.pi * drawn), n, axis=0) * np.hanning(n)[:, None] ** 0.25
    return made - made[0]


SAMPLED: dict[str, Callable[[int, Array], Array]] = {
    "fast, 3 s": lambda seed, path_m: bent(seed, path_m, 0.09),
    "phases drawn anew": lambda seed, path_m: other_phases(seed, path_m, apart=False),
    "phases drawn apart": lambda seed, path_m: other_phases(seed, path_m, apart=True),
    "fast, 2 s": lambda seed, path_m: bent(seed, path_m, 0.043),
    "slow, 3 s": lambda seed, path_m: bent(seed, path_m, 0.028),
    "slow, 2 s": lambda seed, path_m: bent(seed, path_m, 0.013),
}
ONCE: dict[str, Callable[[int, Array], Array]] = {
    "as recorded": lambda _, path_m: path_m,
    "reversed": lambda _, path_m: (path_m - path_m[-1])[::-1],
    "0.6 of its size": lambda _, path_m: 0.6 * path_m,
    "its height alone": lambda _, path_m: path_m * [0, 0, 1],
}
"""Shapes in which nothing is drawn."""


def distance_m(one_m: Array, other_m: Array) -> float:
    """Return the rms distance of two paths (n, 3) whose means are laid upon each other."""
    apart = one_m - other_m
    return float(np.sqrt(((apart - apart.mean(axis=0)) ** 2).sum(axis=1).mean()))


class QuietContext(MemoryContext):
    """Context without checkpoints, which logs the repeats alone."""

    def __init__(self, seed: int) -> None:
        super().__init__(seed)
        self.shifts_m: list[float] = []
        self.log.write = self._keep

    def _keep(self, topic: str, t_s: float, message: object) -> None:
        if topic == "/adapt/repeat":
            self.shifts_m.append(message.shift_m)

    def checkpoint(self, state: object, *, force: bool = False) -> None:
        """Keep nothing: a row is short."""


def row(kind: str, seed: int, t_s: Array, true_m: Array) -> Iterator[object]:
    """Yield what stands in the columns after the seed."""
    given_m = (SAMPLED | ONCE)[kind](seed, true_m)
    yield round(1e3 * distance_m(given_m, true_m))
    settings = dataclasses.replace(build(AdaptSettings, adapt_values(), "adapt"), repeats=REPEATS, thorough=True)
    plan = encode_demonstrations([Demonstration("0", t_s, given_m)], encode_settings())
    ctx = QuietContext(seed)
    try:
        made = Adapt(adapt=settings, robot=bench_arm(), game=kendama_game()).run({"encode": plan}, ctx)
    except StageError as error:
        print(kind, seed, error, file=sys.stderr)
        yield from (False, 0)
        return
    metrics, played = made.metrics, made.artifact.plan
    yield metrics["caught"]
    yield round(REPEATS * (metrics["success_rate"] or 0.0))
    yield round(metrics["tau_scale"], 4)
    yield round(metrics["goal_shift_mm"])
    paths: Array = np.zeros_like(true_m)
    at_s = (t_s - t_s[0]) * played.tau_scale * played.duration_s / (t_s[-1] - t_s[0])
    for name, values in zip(played.coordinates, play(played, at_s).position_m.T, strict=True):
        paths[:, "xyz".index(name)] = values
    yield from (round(1e3 * distance_m(paths, one)) for one in (true_m, given_m))
    yield round(1e3 * float(np.median(ctx.shifts_m))) if ctx.shifts_m else ""


def report(table: Path) -> None:
    """Print the rates and medians of each kind."""
    rows = list(csv.DictReader(table.open()))
    for kind in (*ONCE, *SAMPLED):
        own = [one for one in rows if one["kind"] == kind]
        if not own:
            continue
        sure = sum(int(one["repeats_caught"]) >= 0.9 * REPEATS for one in own)
        interval, repeats = success_interval(sure, len(own)), sum(int(one["repeats_caught"]) for one in own)
        medians = ", ".join(
            f"{name} {np.median([float(one[name]) for one in own if one[name]] or [np.nan]):.4g}"
            for name in (COLUMNS[2], *COLUMNS[5:])
        )
        print(
            f"{kind}: {sure} of {len(own)} [{interval.low:.2f}, {interval.high:.2f}] "
            f"({repeats} of {REPEATS * len(own)} repeats); medians: {medians}"
        )


def main() -> None:
    """Run the rows that are missing, one seed after the other, and print the rates."""
    table = Path(sys.argv[2])
    last, minutes = ([int(one) for one in sys.argv[3:5]] + [LAST_SEED, 600][len(sys.argv) - 3 :])[:2]
    end_s = time.monotonic() + 60 * minutes
    if not table.exists():
        table.write_text(",".join(COLUMNS) + "\n")
    made = {(one["kind"], one["seed"]) for one in csv.DictReader(table.open())}
    t_s, place_m = person_swing(Path(sys.argv[1]))
    kinds = sys.argv[5:] or [*ONCE, *SAMPLED]
    wanted = [(kind, FIRST_SEED) for kind in ONCE if kind in kinds]
    wanted += [(kind, seed) for seed in range(FIRST_SEED, last + 1) for kind in SAMPLED if kind in kinds]
    for kind, seed in wanted:
        if (kind, str(seed)) in made or time.monotonic() > end_s:
            continue
        values = list(row(kind, seed, t_s, place_m - place_m[0]))
        with table.open("a") as file:
            csv.writer(file).writerow([kind, seed, *values, *[""] * (len(COLUMNS) - 2 - len(values))])
    report(table)


if __name__ == "__main__":
    main()
