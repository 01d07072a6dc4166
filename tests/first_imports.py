"""Compilation before a fresh clone's first test: by one worker, not by each.

The drive's compiled code (15 s where numba has no cache of it) is the first worker's. Meanwhile the others import test
modules that do not need it, each its share, for pytest's rewritten asserts are kept in files too; then all share the
rest.
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
    here = Path(__file__).parent
    modules = [path.relative_to(here) for path in sorted(here.rglob("test_*.py"))]
    early = [path for path in modules if path.parts[0] in WITHOUT_KERNEL]
    for path in early[number - 1 :: of - 1] if number > 0 else []:
        _try_import(_module(path))
    with FileLock(locks / "kernel"):
        _try_import(KERNEL)
    for path in sorted(set(modules) - set(early))[number::of]:
        _try_import(_module(path))


def _module(path: Path) -> str:
    return ".".join(("tests", *path.with_suffix("").parts))


def _try_import(name: str) -> None:
    try:
        importlib.import_module(name)
    except (Exception, pytest.skip.Exception):
        return
