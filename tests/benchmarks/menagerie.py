"""Imitation by the third rollout on the arms of MuJoCo Menagerie, with their own servos, open loop.

``python -m tests.benchmarks.menagerie CHECKOUT FOLDER [DRAWS [FIRST]]`` makes in ``FOLDER``, per arm, a URDF of its
model ('kendama robot urdf'), a placement ('kendama robot place'), and one run of the pipeline ``perform`` per draw.
A draw is a seed from ``FIRST`` on, of the twin's rope and drag, which are sampled from 'hard'. Nothing of them, nor of
the servos, is known to the run. The seed of all runs is ``FIRST``, so that an arm adapts the swing once; the encoders
have noise. ``FOLDER/rows.csv`` gains a row a draw; draws that stand there are not played again. The table that is
printed has 95 % intervals (Clopper-Pearson).
"""

from __future__ import annotations

import csv
import json
import subprocess
import sys
from pathlib import Path

import numpy as np
from scipy.stats import binomtest

ROPE_M, LENGTH_M, DRAG = 0.002, 0.40, (0.5, 2.0)
"""Ranges of conf/adapt/uncertainty/hard.yaml, and the rope of conf/game/kendama.yaml."""
ARMS = {
    "iiwa": ("kuka_iiwa_14", [1.484, 1.484, 1.745, 1.309, 2.269, 2.356, 2.356]),
    "panda": ("franka_emika_panda", [2.175] * 4 + [2.61] * 3),
    "xarm7": ("ufactory_xarm7", [3.14] * 7),
    "ur5e": ("universal_robots_ur5e", [3.14] * 6),
    "ur10e": ("universal_robots_ur10e", [2.09] * 2 + [3.14] * 4),
}
"""Folder of the model, and the maker's speed limits."""
OTHERS = {
    "iiwa": "robot.effort_nm=[320,320,176,176,110,40,40]",
    "panda": "robot.acceleration_rad_s2=[15,7.5,10,12.5,15,20,20]",
}
"""The maker's limits that the model lacks, and else a rule of thumb would give."""
COLUMNS = ("arm", "seed", "rope_scale", "drag_scale", "caught_at", "attempts", "lag_ms", "sag_mm")
DEFAULTS = (20, 940000)
THIRD = 3


def command(folder: Path, *words: str) -> str:
    """Run kendama in ``folder`` with a home there; returns what it printed, also of a stage that failed."""
    call = [str(Path(sys.executable).with_name("kendama")), *words]
    return subprocess.run(call, cwd=folder, text=True, stdout=subprocess.PIPE, check=False).stdout


def placed(checkout: Path, folder: Path, arm: str) -> str:
    """Return the folder of the model of ``arm``, which stands under its name where 'kendama robot place' finds it."""
    maker, speeds = ARMS[arm]
    model = str(checkout.resolve() / maker)
    if not (folder / f"conf/robot/{arm}.yaml").exists():
        command(folder, "robot", "urdf", model, "-o", f"{arm}.urdf")
        given = [f"robot.velocity_rad_s={speeds}".replace(" ", ""), *([OTHERS[arm]] if arm in OTHERS else [])]
        given = ["robot=urdf", f"robot.path={arm}.urdf", *given, "-o", f"conf/robot/{arm}.yaml"]
        command(folder, "robot", "place", "-p", "perform", *given)
    return model


def drawn(seed: int) -> tuple[float, float]:
    """Return the factors on rope and drag of a draw: uniform, and uniform in the logarithm."""
    rope, drag = np.random.default_rng(seed).random(2)
    return 1 + (2 * rope - 1) * ROPE_M / LENGTH_M, DRAG[0] * (DRAG[1] / DRAG[0]) ** drag


def played(folder: Path, arm: str, model: str, seed: int, run_seed: int) -> dict[str, object]:
    """Play one draw and return its row."""
    rope, drag = drawn(seed)
    words = ["run", "--thorough", "-p", "perform", f"robot={arm}", "adapt.catch=open_loop", "adapt.repeats=1"]
    words += [f"seed={run_seed}"]
    twin = ["hardware=mujoco", f"hardware.model={model}"]
    twin += [f"hardware.rope_scale={rope:.6f}", f"hardware.drag_scale={drag:.6f}"]
    document = json.loads(command(folder, *words, *twin, "--json"))
    metrics = next(one["metrics"] for one in document["stages"] if one["name"] == "transfer")
    if "imitation_attempts" not in metrics:
        raise RuntimeError(f"{arm}, seed {seed}: {document}")
    lag_s = metrics.get("servo_lag_s")
    values = [metrics.get(key) for key in ("imitation_caught_at", "imitation_attempts")]
    values += [None if lag_s is None else round(1e3 * lag_s, 1), metrics.get("servo_sag_mm")]
    return dict(zip(COLUMNS, (arm, seed, round(rope, 5), round(drag, 4), *values), strict=True))


def main() -> None:
    """Play the draws that are missing, and print how many were caught by the third rollout."""
    checkout, folder = map(Path, sys.argv[1:3])
    given = [int(one) for one in sys.argv[3:5]]
    draws, first = (*given, *DEFAULTS[len(given) :])
    table = folder / "rows.csv"
    folder.mkdir(parents=True, exist_ok=True)
    rows = list(csv.DictReader(table.open())) if table.exists() else []
    for seed in range(first, first + draws):
        for arm in ARMS:
            if not any((one["arm"], int(one["seed"])) == (arm, seed) for one in rows):
                row = played(folder, arm, placed(checkout, folder, arm), seed, first)
                rows.append({key: "" if value is None else str(value) for key, value in row.items()})
                with table.open("w", newline="") as stream:
                    writer = csv.DictWriter(stream, COLUMNS)
                    writer.writeheader()
                    writer.writerows(rows)
    for arm in ARMS:
        at = [float(one["caught_at"] or "inf") for one in rows if one["arm"] == arm]
        caught = sum(one <= THIRD for one in at)
        low, high = binomtest(caught, len(at)).proportion_ci()
        sys.stdout.write(f"{arm}: {caught} of {len(at)} [{low:.2f}, {high:.2f}]; rollouts {at}\n")


if __name__ == "__main__":
    main()
