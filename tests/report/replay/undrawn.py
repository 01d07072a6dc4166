"""A report without its chapters' figures, which matplotlib would take seconds for."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pytest

from kendama_cli.report import page
from kendama_cli.report.page import make_report


def undrawn_report(run: Mapping[str, Any], logs: Mapping[str, Path], *stages: str) -> str:
    """The page of ``stages`` of the run."""
    kept = {name: logs[name] for name in stages}
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(page, "draw", lambda declaration, log: ([], ""))
        return make_report({**run, "stages": [{"name": name} for name in kept]}, kept)
