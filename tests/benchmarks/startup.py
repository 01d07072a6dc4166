"""Cost of the command when there is nothing to compute, against a bare interpreter in the same run.

``python -m tests.benchmarks.startup`` prints name, median, unit and ratio. The commands take turns, so that a change
in the machine's load meets them all; the demonstrations are read and encoded once before.
"""

from __future__ import annotations

import statistics
import subprocess
import sys
import tempfile
import time

from kendama_cli.pipeline.command_cache import SETTLED_S

ROUNDS = 21
KENDAMA = (sys.executable, "-m", "kendama_cli.cli.main")
RUN = (*KENDAMA, "run", "-p", "imitation", "--until", "encode")
COMMANDS = {
    "python -c pass": (sys.executable, "-c", "pass"),
    "kendama run, nothing to do": RUN,
    "kendama run --json, nothing to do": (*RUN, "--json"),
    "kendama --help": (*KENDAMA, "--help"),
    "kendama --version": (*KENDAMA, "--version"),
}


def measured(folder: str, rounds: int = ROUNDS) -> dict[str, float]:
    """Median wall time of each command [s], taken in turns in ``folder``."""
    for command in (RUN, (*RUN, "--json")):
        for _ in range(2):  # a file that the first made just now is relied on from the second on
            subprocess.run(command, cwd=folder, check=True, capture_output=True)
            time.sleep(SETTLED_S)
    taken: dict[str, list[float]] = {name: [] for name in COMMANDS}
    for _ in range(rounds):
        for name, command in COMMANDS.items():
            began = time.perf_counter()
            subprocess.run(command, cwd=folder, check=True, capture_output=True)
            taken[name].append(time.perf_counter() - began)
    return {name: statistics.median(times) for name, times in taken.items()}


def main() -> None:
    """Print the table."""
    with tempfile.TemporaryDirectory() as folder:
        medians = measured(folder)
    bare_s = medians["python -c pass"]
    for name, value_s in medians.items():
        print(f"{name:36s} {1e3 * value_s:8.1f} ms   {value_s / bare_s:6.2f} x python -c pass")


if __name__ == "__main__":
    main()
