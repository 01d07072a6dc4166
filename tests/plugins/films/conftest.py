"""Training in a sixth of its time, where a test asks for what follows from it."""

from __future__ import annotations

import pytest

from kendama_cli.plugins.films import self_training, training


@pytest.fixture
def quick_training(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    """Train one classifier of 500 steps, and once more by the film, in the place of three and three; not if "whole"."""
    if getattr(request, "param", "quick") == "whole":
        return
    monkeypatch.setattr(training, "CLASSIFIERS", 1)
    monkeypatch.setattr(training, "STEPS", 500)
    monkeypatch.setattr(self_training, "ROUNDS", 1)
