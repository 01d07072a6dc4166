"""What ``kendama report --film`` does; opened only then."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from kendama_cli.cli import render
from kendama_cli.errors import InputError
from kendama_cli.pipeline.film import film_run


def film_of(records: Sequence[Mapping[str, Any]], path: Path) -> None:
    """Film the one run in ``records``; raises InputError for several."""
    if len(records) != 1:
        raise InputError(str(path), f"{len(records)} runs are asked for", remedy="name one run: a film shows one")
    pictures = film_run(records[0], path)
    render.text(f"{path}: {pictures} pictures")
