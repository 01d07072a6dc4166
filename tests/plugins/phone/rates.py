"""Rates at which an arm catches with a bent swing, beside swings of wrong shape, as CSV.

``python -m tests.plugins.phone.rates RECORDING FOLDER [DRAWS] [FIRST]`` bends a person's swing (RECORDING as in
``phones.person_swing``) by smooth errors as large as those of a hand beside motion capture: 13 and 28 mm rms after 2
and 3 s of slow motion, 43 and 90 mm of fast motion. The wrong shapes are the swing reversed in time, at 0.6 of its
size, and with the phases of its spectrum drawn anew. Each draw is one ``kendama run -p imitation`` under
``adapt/uncertainty=hard``, with the visual catch. Rows are added to FOLDER/rates.csv; a draw that stands there is left
out. Draws of the seeds FIRST (40000) on are taken in turns over the kinds.
"""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import numpy as np

from tests.plugins.phone.phones import person_swing

BENDS_M = {"slow, 2 s": 0.013, "slow, 3 s": 0.028, "fast, 2 s": 0.043, "fast, 3 s": 0.09}
WRONG = ("reversed", "0.6 of its size", "phases drawn anew")
HEAD = "kind,seed,error_mm,caught,success_rate,tau_scale"


def bent(seed: int, path_m: np.ndarray, rms_m: float) -> np.ndarray:
    """Add a smooth error that grows from the start, with half of it across the swing's plane."""
    u = np.linspace(0, 1, len(path_m))
    a, b, c = np.random.default_rng(seed).normal(size=(3, 3))
    bump = 16 * u**2 * (1 - u) ** 2
    error = np.outer(3 * u**2 - 2 * u**3, a) + np.outer(bump, b) + np.outer(np.sin(2 * np.pi * u) * bump, c)
    error[:, 1] *= 0.5
    size = np.sqrt(((error - error.mean(axis=0)) ** 2).sum(axis=1).mean())
    return path_m + error * rms_m / size


def wrong(seed: int, path_m: np.ndarray, kind: str) -> np.ndarray:
    """Return a path of another shape."""
    if kind == "reversed":
        return (path_m - path_m[-1])[::-1]
    if kind == "0.6 of its size":
        return 0.6 * path_m
    n = len(path_m)
    spectrum = np.fft.rfft(path_m - np.outer(np.linspace(0, 1, n), path_m[-1]), axis=0)
    phases = np.exp(2j * np.pi * np.random.default_rng(seed).random(spectrum.shape[0]))[:, None]
    made = np.fft.irfft(spectrum * phases, n, axis=0) * np.hanning(n)[:, None] ** 0.25
    return made - made[0]


def main() -> None:
    """Run the draws that are missing."""
    folder = Path(sys.argv[2])
    draws, first = (int(one) for one in (*sys.argv[3:5], *("20", "40000")[len(sys.argv) - 3 :]))
    folder.mkdir(parents=True, exist_ok=True)
    table = folder / "rates.csv"
    if not table.exists():
        table.write_text(HEAD + "\n")
    t_s, place_m = person_swing(Path(sys.argv[1]))
    path_m = place_m - place_m[0]
    for seed in range(first, first + draws):
        for kind in ("fast, 3 s", "phases drawn anew", "slow, 3 s", "fast, 2 s", "slow, 2 s", *WRONG[:2]):
            if f'"{kind}",{seed},' in table.read_text() or (kind in WRONG[:2] and seed > first):
                continue  # two of the wrong shapes have nothing to draw
            made = bent(seed, path_m, BENDS_M[kind]) if kind in BENDS_M else wrong(seed, path_m, kind)
            swing = folder / "swing.csv"
            np.savetxt(
                swing, np.column_stack([t_s, made]), delimiter=",", header="t_s,x_m,y_m,z_m", comments="", fmt="%.6f"
            )
            off_mm = 1e3 * float(np.sqrt((((made - path_m) - (made - path_m).mean(axis=0)) ** 2).sum(axis=1).mean()))
            command = [sys.executable, "-m", "kendama_cli.cli.main", "run", "-p", "imitation", "--json"]
            settings = [f"capture.path={swing}", "adapt/uncertainty=hard", f"seed={seed}"]
            done = subprocess.run([*command, *settings], capture_output=True, text=True, check=False)
            metrics = {}
            if done.returncode == 0:
                metrics = {one["name"]: one["metrics"] for one in json.loads(done.stdout)["stages"]}["adapt"]
            elif kind in BENDS_M:
                print(done.stderr[-500:], file=sys.stderr)
            row = (metrics.get(key) for key in ("caught", "success_rate", "tau_scale"))
            with table.open("a") as rows:
                rows.write(f'"{kind}",{seed},{off_mm:.0f},{",".join("" if one is None else str(one) for one in row)}\n')


if __name__ == "__main__":
    main()
