"""What the tests of the command line share: an empty folder with a home of its own."""

from __future__ import annotations

from pathlib import Path

import pytest


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The folder that the command is typed in; its home is beneath it."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("KENDAMA_HOME", str(tmp_path / "store"))
    return tmp_path
