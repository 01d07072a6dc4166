"""Makes the bundled demonstrations: ``python data/generate.py [FOLDER]`` writes them to FOLDER (default: beside this).

They are synthetic. The swing is five minimum-jerk movements, found by ``design.py``; twelve repetitions of it vary as
a person's do: in tempo, size, timing, heading, sway and tremor. The numbers are drawn from a fixed seed, so every run
writes the same bytes.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

COUNT = 12
RATE_HZ = 100.0
SEED = 1807
TEMPO = 1.07
"""The swing is demonstrated this much faster than it was designed: the robot is to find its own, slower tempo."""


@dataclass(frozen=True)
class Movement:
    """One minimum-jerk movement of the cup along ``axis`` by ``size_m``, from ``start_s`` for ``duration_s``."""

    axis: int
    size_m: float
    start_s: float
    duration_s: float


SWING = (
    Movement(0, 0.3413, 0.1534, 0.7161),  # aside, so that the ball lags and swings after
    Movement(0, -0.5026, 0.4898, 0.9912),  # back across: pumps the ball
    Movement(2, -0.1468, 0.7283, 0.5903),  # down while the ball passes below
    Movement(2, 0.3972, 0.9681, 0.7371),  # up: the ball flies round and over the rim
    Movement(2, -0.3776, 1.2970, 0.8988),  # down with the falling ball
)
"""The designed swing; with the rope of conf/game/kendama.yaml the ball falls into the cup at its tempo, 3 % faster or
slower included."""


def minimum_jerk(share: np.ndarray) -> np.ndarray:
    """From 0 to 1 with rest at both ends (Flash and Hogan 1985)."""
    u = np.clip(share, 0.0, 1.0)
    return u * u * u * (10.0 + u * (-15.0 + 6.0 * u))


def cup_path(t_s: np.ndarray, movements: Sequence[Movement]) -> np.ndarray:
    """The cup (n, 3) [m] relative to its start."""
    made = np.zeros((len(t_s), 3))
    for one in movements:
        made[:, one.axis] += one.size_m * minimum_jerk((t_s - one.start_s) / one.duration_s)
    return made


def tremor(rng: np.random.Generator, count: int) -> np.ndarray:
    """A hand's tremor (count, 3) of unit deviation: white noise through a resonance at 9 Hz."""
    radius, angle = 0.94, 2.0 * np.pi * 9.0 / RATE_HZ
    noise = rng.standard_normal((count + 100, 3))
    made = np.zeros_like(noise)
    for i in range(2, len(made)):
        made[i] = 2.0 * radius * np.cos(angle) * made[i - 1] - radius * radius * made[i - 2] + noise[i]
    settled = made[100:]
    return settled / np.sqrt(np.mean(settled * settled))


def demonstrations() -> list[tuple[str, np.ndarray, np.ndarray]]:
    """Name, times (n,) [s] and positions (n, 3) [m] of each demonstration."""
    rng = np.random.default_rng(SEED)
    # what varies from one swing to the next is centred over the set: a person errs to both sides of what is meant
    varied = rng.standard_normal((COUNT, 20))
    varied -= varied.mean(axis=0)
    return [_demonstration(f"swing-{i + 1:02d}", varied[i], rng) for i in range(COUNT)]


def _demonstration(name: str, draw: np.ndarray, rng: np.random.Generator) -> tuple[str, np.ndarray, np.ndarray]:
    tempo = TEMPO * (1.0 + 0.04 * draw[0])
    size = 1.0 + 0.02 * draw[1]
    head_s, tail_s = 0.2 + 0.3 * rng.random(2)
    movements = [
        Movement(
            one.axis,
            one.size_m * size * (1.0 + 0.012 * draw[2 + k]),
            head_s + (one.start_s + 0.006 * draw[7 + k]) / tempo,
            one.duration_s * (1.0 + 0.01 * draw[12 + k]) / tempo,
        )
        for k, one in enumerate(SWING)
    ]
    end_s = max(one.start_s + one.duration_s for one in movements) + tail_s
    t_s = np.arange(round(end_s * RATE_HZ) + 1) / RATE_HZ
    path = cup_path(t_s, movements)
    # the swing plane is not quite x-z, and the arm sways sideways
    path[:, 1] = 0.015 * draw[17] * path[:, 0] + 0.003 * draw[18] * minimum_jerk(t_s / end_s)
    moving = np.abs(np.gradient(path[:, 0], t_s)) + np.abs(np.gradient(path[:, 2], t_s))
    path += 5e-5 * (1.0 + 3.0 * moving[:, None]) * tremor(rng, len(t_s))
    path += 3e-5 * rng.standard_normal(path.shape)  # the tracker's own noise
    stand = np.array([0.45, -0.02, 1.05]) + 0.02 * rng.standard_normal(3)
    return name, t_s, path + stand


def write(folder: Path) -> list[Path]:
    """Write all demonstrations as CSV into ``folder``; returns the files."""
    folder.mkdir(parents=True, exist_ok=True)
    files = []
    for name, t_s, path in demonstrations():
        lines = [
            "# origin: synthetic. A demonstration of a swing, made by data/generate.py; no person was recorded.",
            "# Time [s] and position of the cup [m]: x in the swing plane, y sideways, z up. 100 Hz.",
            "t_s,x_m,y_m,z_m",
            *(f"{t:.2f},{x:.5f},{y:.5f},{z:.5f}" for t, (x, y, z) in zip(t_s, path, strict=True)),
        ]
        file = folder / f"{name}.csv"
        file.write_text("\n".join(lines) + "\n", encoding="ascii", newline="\n")
        files.append(file)
    return files


if __name__ == "__main__":
    write(Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parent / "demonstrations")
