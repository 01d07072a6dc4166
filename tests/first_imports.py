"""Compilation before a fresh clone's first test: by one worker, not by each.

The drive's compiled code (15 s where numba has no cache of it) is the first worker's. Meanwhile the others import test
modules that do not need it, each its share, for pytest's rewritten asserts are kept in files too.
"""

from __future__ import annotations

import importlib
import os
from pathlib import Path

import pytest
from filelock import FileLock

KERNEL = "kendama_cli.simulation.dart.step_kernel"
WITHOUT_KERNEL = (
    "cli",
    "config",
    "data",
    "docs",
    "learning",
    "log",
    "motion",
    "pipeline",
    "rendering",
    "report",
    "vision",
)
"""Folders of tests that do not import it; where one does, its worker waits a little sooner."""


def import_in_turn(locks: Path) -> None:
    """Import this worker's share; the compiled code is there in the end."""
    number, of = (
        int(os.environ[name].removeprefix("gw")) for name in ("PYTEST_XDIST_WORKER", "PYTEST_XDIST_WORKER_COUNT")
    )
    if number > 0:
        here = Path(__file__).parent
        modules = sorted(path for folder in WITHOUT_KERNEL for path in (here / folder).rglob("test_*.py"))
        for path in modules[number - 1 :: of - 1]:
            _try_import(".".join(path.relative_to(here.parent).with_suffix("").parts))
    with FileLock(locks / "kernel"):
        _try_import(KERNEL)


def _try_import(name: str) -> None:
    try:
        importlib.import_module(name)
    except (Exception, pytest.skip.Exception):
        return
