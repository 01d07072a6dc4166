"""The lowest versions that pyproject.toml allows, and the newest there are, do the work."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

SCRIPT = Path(__file__).resolve().parents[2] / ".ci" / "lowest-versions"


@pytest.mark.slow  # downloads what kendama needs and compiles its kernels
@pytest.mark.parametrize("resolution", ["lowest-direct", "highest"])
def test_a_new_environment_of_these_versions_runs_the_imitation_whole(resolution: str) -> None:
    clean = {key: value for key, value in os.environ.items() if not key.startswith(("PYTHON", "KENDAMA", "VIRTUAL_"))}
    done = subprocess.run(
        [SCRIPT, "-p", "imitation"],
        env={**clean, "PYTHON": sys.executable, "RESOLUTION": resolution},
        capture_output=True,
        text=True,
        check=False,
    )
    if "error sending request" in done.stderr or "No matching distribution found for uv" in done.stderr:
        pytest.skip("no package index answers")
    assert done.returncode == 0, done.stdout + done.stderr
    assert "adapt     ran    success_rate 1" in done.stdout
