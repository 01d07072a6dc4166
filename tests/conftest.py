"""Fixtures that every test may use."""

from __future__ import annotations

import signal
from pathlib import Path

import pytest

from tests.toy_project import ToyProject

# started as a shell's background job, this process ignores Ctrl-C, and so would all that it starts
signal.signal(signal.SIGINT, signal.default_int_handler)

RECORDINGS = Path(__file__).resolve().parents[2] / "shared" / "data"


@pytest.fixture
def toy(tmp_path: Path) -> ToyProject:
    """A project with stages of its own, in an otherwise empty folder."""
    return ToyProject(tmp_path)


@pytest.fixture(params=["0", "1"], ids=["linux", "portable"])
def each_way(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> bool:
    """Locks and processes by Linux's own means and by the portable ones, in turn; whether they are portable."""
    monkeypatch.setenv("KENDAMA_PORTABLE", request.param)
    return bool(request.param == "1")


@pytest.fixture(scope="session")
def recordings() -> Path:
    """The folder of real recordings beside the repository; the test is skipped where it is absent."""
    if not RECORDINGS.is_dir():
        pytest.skip(f"real recordings are not at {RECORDINGS}")
    return RECORDINGS
