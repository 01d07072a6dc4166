"""The scripts in examples/ run as they stand, and print what they promise."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from tests import warm_command

ROOT = Path(__file__).resolve().parents[2]
EXPECTED = {
    "primitive.py": "tau 1.",
    "predict_catch.py": "after 0.2 s: down at 0.45",  # z = 1.1 + 2 t - g t^2 / 2 falls through 1.0 at 0.453 s
    "run_and_read.py": "mm rms",
    "catch_by_hand.py": "of 50 by the law",
    "swing_to_goals.py": "30 of 30 goals by the pump",
    "gymnasium_random.py": "of 20 random rollouts reached the goal",
}
WITH_OTHERS = {
    "learn_with_stable_baselines3.py": ("stable_baselines3", ["dqn", "200", "1"], "dqn: 0."),
    "optuna_over_runs.py": ("optuna", ["home", "1"], "as shipped "),
}
"""Examples with a package that the tests do not bring: the package, arguments, what is printed."""


def test_every_example_is_run_here() -> None:
    assert {path.name for path in (ROOT / "examples").glob("*.py")} == {*EXPECTED, *WITH_OTHERS}


@pytest.mark.slow
@pytest.mark.parametrize("name", sorted(WITH_OTHERS))
def test_an_example_with_a_package_of_others_runs(name: str, tmp_path: Path) -> None:
    package, words, printed = WITH_OTHERS[name]
    pytest.importorskip(package, reason=f"needs {package} (pip install {package})")
    command = [sys.executable, str(ROOT / "examples" / name), *words]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, timeout=600, check=False)
    assert done.returncode == 0, done.stderr
    assert printed in done.stdout


@pytest.mark.parametrize("name", sorted(EXPECTED))
def test_an_example_runs(name: str, tmp_path: Path) -> None:
    words = [str(ROOT / "examples" / name), str(tmp_path / "home")]
    done = warm_command.python(words, tmp_path, os.environ, 240)
    assert done.returncode == 0, done.stderr
    assert EXPECTED[name] in done.stdout
