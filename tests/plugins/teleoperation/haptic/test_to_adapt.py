"""Path from a haptic device's swing to a caught ball."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from tests.plugins.teleoperation.haptic.test_device import operator


@pytest.mark.slow
@pytest.mark.timeout(900)
def test_what_a_person_swings_at_the_device_is_caught_by_the_arm(tmp_path: Path) -> None:
    """By the command line; the person and the device are a process, the arm is adapt's, under the default errors."""
    words = ["capture=haptic", "capture.swings=1", "capture.watchdog_s=0.5", "adapt.repeats=10"]
    with operator() as port:
        command = [sys.executable, "-m", "kendama_cli.cli.main", "run", "-p", "imitation", "--json"]
        done = subprocess.run(
            [*command, *words, f"capture.port={port}"], cwd=tmp_path, capture_output=True, text=True, check=False
        )
    assert done.returncode == 0, done.stderr
    told: dict[str, dict[str, Any]] = {one["name"]: one["metrics"] for one in json.loads(done.stdout)["stages"]}
    assert told["capture"]["n_demonstrations"] == 1
    assert told["adapt"]["caught"] is True
    assert told["adapt"]["success_rate"] >= 0.8, "20 of 20 of another swing at it"
    assert len(list((tmp_path / "haptic-swings").glob("*.csv"))) == 1
