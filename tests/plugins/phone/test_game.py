"""Path from a phone's recording to an arm that catches."""

from __future__ import annotations

import json
import subprocess
import sys

import numpy as np
import pytest

from tests.plugins.phone.phones import bundled_swing, take, write_phyphox


@pytest.mark.slow
@pytest.mark.timeout(1200)
def test_a_phone_carried_along_a_swing_teaches_an_arm_to_catch(tmp_path):
    one = take(np.random.default_rng(11), bundled_swing(1), lean_deg=15.0)
    write_phyphox(tmp_path / "swing.zip", one.t_s, one.force, one.rate)
    overrides = ["capture=phone", "capture.path=swing.zip", "adapt.repeats=5"]
    command = [sys.executable, "-m", "kendama_cli.cli.main", "run", "-p", "imitation", "--json", *overrides]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    metrics = {stage["name"]: stage["metrics"] for stage in json.loads(done.stdout)["stages"]}
    assert metrics["capture"]["n_demonstrations"] == 1
    assert metrics["adapt"]["caught"] is True
    assert "neither is a bound" in done.stdout + done.stderr
