"""The scripts in examples/ run as they stand, and print what they promise."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
EXPECTED = {
    "primitive.py": "tau 1.",
    "predict_catch.py": "after 0.2 s: down at 0.45",  # z = 1.1 + 2 t - g t^2 / 2 falls through 1.0 at 0.453 s
    "run_and_read.py": "mm rms",
    "catch_by_hand.py": "of 50 by the law",
    "gymnasium_random.py": "of 20 random rollouts reached the goal",
}


def test_every_example_is_run_here() -> None:
    assert {path.name for path in (ROOT / "examples").glob("*.py")} == set(EXPECTED)


@pytest.mark.parametrize("name", sorted(EXPECTED))
def test_an_example_runs(name: str, tmp_path: Path) -> None:
    done = subprocess.run(
        [sys.executable, ROOT / "examples" / name, tmp_path / "home"],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert EXPECTED[name] in done.stdout
