"""Time and memory of the main job from nothing, with and without evaluations that end early, and of its stages.

``python -m tests.benchmarks.main_job [ROUNDS]`` runs each in turn in new homes, seed 0, then the stages (with 0 rounds
these alone). Run it twice: the first compiles what the second finds cached.
Cores are processor time over wall time; the peak is that of the largest process. A stage is run alone, after those
before it. Another tree beside this one is measured with ``PYTHONPATH=TREE`` in turn.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from dataclasses import dataclass

STAGES = ("capture", "encode", "adapt", "learn", "predict", "transfer")
WHOLE = {"main job": (), "main job, --thorough": ("--thorough",)}


@dataclass(frozen=True)
class Cost:
    """Wall and processor time [s] and peak memory of the largest process [MB] of one command."""

    wall_s: float
    processor_s: float
    peak_mb: float

    def text(self) -> str:
        """Return the figures of a row."""
        cores = self.processor_s / self.wall_s
        return f"{self.wall_s:8.1f} s {self.processor_s:8.1f} s {cores:6.2f} cores {self.peak_mb:8.0f} MB"


def cost(words: Sequence[str]) -> Cost:
    """Run ``kendama`` with ``words`` and return its cost."""
    began_s = time.monotonic()
    command = [sys.executable, "-m", "kendama_cli.cli.main", *words]
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    _, status, used = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode:
        raise SystemExit(f"kendama {' '.join(words)} ended with {process.returncode}")
    return Cost(time.monotonic() - began_s, used.ru_utime + used.ru_stime, used.ru_maxrss / 1024)


def main() -> None:
    """Print the rows."""
    rounds = int(sys.argv[1]) if len(sys.argv) > 1 else 3
    found: dict[str, list[Cost]] = {name: [] for name in WHOLE}
    for _ in range(rounds):
        for name, words in WHOLE.items():
            with tempfile.TemporaryDirectory() as home:
                found[name].append(cost(("run", "--home", home, *words)))
                print(f"{name:24s} {found[name][-1].text()}", flush=True)
    if rounds:
        for what in ("wall_s", "processor_s"):
            early, thorough = (min(getattr(one, what) for one in costs) for costs in found.values())
            print(f"{'least ' + what:24s} {early / thorough:8.2f} of --thorough")
    with tempfile.TemporaryDirectory() as home:
        for stage in STAGES:
            print(f"{stage:24s} {cost(('run', '--home', home, '--until', stage)).text()}", flush=True)


if __name__ == "__main__":
    main()
