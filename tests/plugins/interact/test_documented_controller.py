"""The controller of examples/springs, which a how-to page shows, keeps the laws of controllers, as ours do."""

from __future__ import annotations

import os
from pathlib import Path

from tests import warm_command
from tests.documented_package import install_example


def test_a_controller_passes_its_suite_chosen_by_kind_alone(tmp_path: Path) -> None:
    install_example("springs", tmp_path)
    words = ["-m", "pytest", "-q", "-rp", "-p", "no:cacheprovider", "-p", "no:xdist", "-p", "kendama_cli.conformance"]
    words += ["--suite", "controller", "--override", "interact/controller=springs"]
    environment = {**os.environ, "PYTHONPATH": str(tmp_path), "PYTHONDONTWRITEBYTECODE": "1"}
    done = warm_command.python(words, tmp_path, environment, 240)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "PASSED ::test_the_controller_keeps_the_law[force]" in done.stdout
