"""Training in a sixth of its time, where a test asks for what follows from it."""

from __future__ import annotations

import pytest

from kendama_cli.plugins.films import training


@pytest.fixture
def quick_training(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    """Train one classifier of 500 steps in the place of three of 1500; not if "whole"."""
    if getattr(request, "param", "quick") == "whole":
        return
    monkeypatch.setattr(training, "CLASSIFIERS", 1)
    monkeypatch.setattr(training, "STEPS", 500)
