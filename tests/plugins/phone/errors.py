"""Errors of reconstructed paths beside plain double integration: simulated phones, and recordings of others.

``python -m tests.plugins.phone.errors [FIRST LAST]`` prints for a person's swing in simulated phones (seeds FIRST to
LAST, 42000 to 42099) the medians and the fraction of likely errors within a factor of three of the true ones, at 20 and
45 degrees of lean; then the errors of the recordings beside the repository.
"""

from __future__ import annotations

import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pandas as pd
from scipy.interpolate import CubicSpline

from kendama_cli.artifacts.proportion import success_interval
from kendama_cli.plugins.phone.files import read_exports
from kendama_cli.plugins.phone.swings import Reconstruction, reconstructed
from kendama_cli.report.intervals import quantile_interval
from tests.plugins.phone.phones import REAL, person_swing, plain_path, rms_m, settings, take, write_phyphox

SEEDS = (42000, 42099)
LEANS_DEG = (20.0, 45.0)


def simulated(folder: Path, seed: int, lean_deg: float) -> tuple[float, float, float]:
    """Return the errors of the path and of plain integration, and the likely one [m]."""
    one = take(np.random.default_rng(seed), person_swing(), lean_deg=lean_deg)
    path = str(write_phyphox(folder / "swing.zip", one.t_s, one.force, one.rate))
    whole = reconstructed(read_exports((path,))[0], settings(path))
    true = CubicSpline(one.true_s, one.true_m)
    error_m = rms_m(whole.recording.position_m, true(np.clip(whole.signals.t_s, 0, one.true_s[-1])))
    plain_m = rms_m(plain_path(one.t_s, one.force, one.rate), true(np.clip(one.t_s, 0, one.true_s[-1])))
    return error_m, plain_m, max(motion.evidence.expected_m for motion in whole.motions)


def recorded(name: str) -> tuple[Reconstruction, np.ndarray]:
    """Return a recording of others, and its path by plain integration until its motion ends."""
    files = tuple(str(one) for one in sorted((REAL / name).glob("*.csv")) if one.name != "truth.csv")
    whole = reconstructed(read_exports(files)[0], settings(list(files)))
    signals = whole.signals
    plain_m = plain_path(signals.t_s, signals.force(signals.t_s), signals.rate(signals.t_s))
    return whole, plain_m[: whole.motions[-1].end + 1]


def ends_off_m(name: str, path_m: np.ndarray) -> float:
    """Return the error of the end of a path (n, 3): of height and level distance, as far as they are known."""
    level_m, height_m = np.hypot(*path_m[-1, :2]), path_m[-1, 2]
    if name == "slide":  # over a table
        return float(abs(height_m))
    if name == "there-and-back":
        return float(np.hypot(level_m, height_m))
    truth_m = truth_of(name)[-1, 1:]
    return float(np.hypot(level_m - np.hypot(*truth_m[:2]), height_m - truth_m[2]))


def lift_off_m(t_s: np.ndarray, path_m: np.ndarray) -> tuple[float, float]:
    """Return the rms errors of height and place of the sensor that a robot lowers, which has no heading."""
    truth = truth_of("robot-lift")
    inside = (truth[:, 0] > t_s[0]) & (truth[:, 0] < t_s[-1])
    off_m = CubicSpline(t_s, path_m)(truth[inside, 0]) - truth[inside, 1:]
    return float(np.sqrt(np.mean(off_m[:, 2] ** 2))), float(np.sqrt((off_m**2).sum(axis=1).mean()))


def truth_of(name: str) -> np.ndarray:
    """Return times and true places (n, 4) of a recording."""
    return pd.read_csv(REAL / name / "truth.csv").to_numpy()[:, :4]


def told_of_simulated(first: int, last: int) -> Iterator[str]:
    """Yield a line for each lean."""
    with tempfile.TemporaryDirectory() as folder:
        for lean_deg in LEANS_DEG:
            made = np.array([simulated(Path(folder), seed, lean_deg) for seed in range(first, last + 1)])
            near = np.abs(np.log(made[:, 2] / made[:, 0])) < np.log(3)
            medians = [f"{1e3 * np.median(one):.1f} mm {_interval(1e3 * one)}" for one in made[:, :2].T]
            interval = success_interval(int(near.sum()), len(near))
            yield (
                f"{lean_deg:.0f} deg, {len(made)} draws: {medians[0]}, plain integration {medians[1]}; likely error "
                f"within a factor of 3: {near.mean():.2f} [{interval.low:.2f}, {interval.high:.2f}]"
            )


def told_of_others() -> Iterator[str]:
    """Yield a line for each recording of which the end is known."""
    for name in ("slide", "there-and-back", "robot-lift", "stride"):
        whole, plain_m = recorded(name)
        path_m = whole.recording.position_m[: len(plain_m)]
        ours_mm, plain_mm = (1e3 * ends_off_m(name, one) for one in (path_m, plain_m))
        yield f"{name}: end off by {ours_mm:.1f} mm, plain integration {plain_mm:.0f} mm"
        if name == "robot-lift":
            t_s = whole.signals.t_s[: len(plain_m)]
            for kind, ours_m, null_m in zip(
                ("height", "place"), lift_off_m(t_s, path_m), lift_off_m(t_s, plain_m), strict=True
            ):
                yield f"{name}: {kind} off by {1e3 * ours_m:.1f} mm rms, plain integration {1e3 * null_m:.0f} mm"


def _interval(values: np.ndarray) -> str:
    low, high = quantile_interval(values) or (float("nan"),) * 2
    return f"[{low:.1f}, {high:.1f}]"


def main() -> None:
    """Print all lines."""
    for line in told_of_others() if REAL.is_dir() else ():
        print(line, flush=True)
    first, last = ([int(one) for one in sys.argv[1:3]] or list(SEEDS))[:2]
    for line in told_of_simulated(first, last):
        print(line, flush=True)


if __name__ == "__main__":
    main()
