"""Parts that kendama can be installed without, and what each of them brings.

``parts.json`` beside this file has ``part: {entry point group: [names]}``; a test holds it against ``pyproject.toml``.
It is read only where something is missing, so that the answer names the part that has it.
"""

from __future__ import annotations

import json
from pathlib import Path

TABLE = Path(__file__).with_suffix(".json")


def missing_part(group: str, name: str) -> str | None:
    """Return the part of kendama that brings ``name`` of the entry point group ``group``; None where no part does."""
    parts = json.loads(TABLE.read_text(encoding="utf-8"))
    return next((part for part, brought in parts.items() if name in brought.get(group, ())), None)


def comes_with(what: str, group: str, name: str) -> str | None:
    """Return the line that tells which part brings ``what``, the entry point ``name`` of ``group``, and how to get it.

    None where no part of kendama does.
    """
    part = missing_part(group, name)
    line = f"{what} comes with the part {part}, which this installation lacks; install the whole of kendama-cli"
    return None if part is None else line
