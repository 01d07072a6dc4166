"""The controller of examples/springs, which a how-to page shows, and ours, keep the laws of controllers."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from tests import warm_command
from tests.documented_package import install_example


@pytest.mark.parametrize("kind", ["springs", "force", "impedance"])
def test_a_controller_passes_its_suite_chosen_by_kind_alone(tmp_path: Path, kind: str) -> None:
    install_example("springs", tmp_path)
    words = ["-m", "pytest", "-q", "-rp", "-p", "no:cacheprovider", "-p", "no:xdist", "-p", "kendama_cli.conformance"]
    words += ["--suite", "controller", "--override", f"interact/controller={kind}"]
    environment = {**os.environ, "PYTHONPATH": str(tmp_path), "PYTHONDONTWRITEBYTECODE": "1"}
    done = warm_command.python(words, tmp_path, environment, 240)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "PASSED ::test_the_controller_keeps_the_law[force]" in done.stdout
