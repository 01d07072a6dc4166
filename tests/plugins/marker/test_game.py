"""Path from films of a printed marker to ten games on the twin."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.plugins.marker.marker_film import FIELD_DEG, write_film

DEMONSTRATIONS = Path(__file__).resolve().parents[3] / "data" / "demonstrations"
OVERRIDES = [
    *("capture=marker", "capture.path=films/*.avi", f"capture.field_of_view_deg={FIELD_DEG:.3f}"),
    *(
        "adapt.repeats=5",
        "predict.flights=5",
        "transfer.evaluation_rollouts=1",
        "transfer.max_rollouts=1",
        "transfer.games=10",
    ),
]


def write_films(folder: Path, count: int = 3, rate_hz: float = 60.0) -> None:
    """Bundled swings with the marker at 1.2 m, tilted as a hand holds it, exposed for 3 ms."""
    folder.mkdir()
    for number in range(1, count + 1):
        rows = np.loadtxt(DEMONSTRATIONS / f"swing-{number:02d}.csv", delimiter=",", comments=("#", "t"))
        t_s, place_m = rows[:, 0], rows[:, 1:] - rows[:, 1:].mean(axis=0) + [0.0, 1.2, 0.0]
        tilt = 0.05 * np.sin(2 * np.pi * t_s / t_s[-1])
        turns = np.column_stack((0.3 + tilt, 0.3 + 0 * tilt, 0 * tilt))
        write_film(
            folder / f"{number}.avi", t_s, place_m, turns, rate_hz=rate_hz, exposure_s=0.003, seed=10000 + number
        )


@pytest.mark.slow
@pytest.mark.timeout(1800)
def test_a_film_of_a_marker_becomes_ten_games(tmp_path: Path) -> None:
    write_films(tmp_path / "films")
    command = [sys.executable, "-m", "kendama_cli.cli.main", "run", "--json", "--thorough", *OVERRIDES]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    told: dict[str, dict[str, Any]] = {one["name"]: one["metrics"] for one in json.loads(done.stdout)["stages"]}
    assert told["capture"]["n_demonstrations"] == 3
    assert told["adapt"]["caught"] is True
    assert told["transfer"]["games"] == 10
    assert told["transfer"]["imitation_caught"] is True
    assert told["transfer"]["caught_rate"] >= 0.7  # 10 of 10 bundled games; of 0.95 a 0.7 or less has a chance of 1 %
