"""The benchmarks run with what their extra brings, which has no pytest, and with the code as it is now."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

HERE = Path(__file__).parent
WITHOUT_PYTEST = """
import importlib, sys
sys.modules["pytest"] = None
for name in sys.argv[1:]:
    importlib.import_module(f"tests.benchmarks.{name}")
"""


@pytest.mark.slow
def test_no_benchmark_needs_what_only_tests_have() -> None:
    names = sorted(path.stem for path in HERE.glob("[a-z]*.py") if not path.name.startswith("test_"))
    command = [sys.executable, "-c", WITHOUT_PYTEST, *names]
    done = subprocess.run(command, cwd=HERE.parents[1], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
