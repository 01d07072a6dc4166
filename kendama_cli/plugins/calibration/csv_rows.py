"""Small tables of a person's own, row by row."""

from __future__ import annotations

import csv
from pathlib import Path

from kendama_cli.errors import InputError


def csv_rows(path: Path, remedy: str) -> list[dict[str, str]]:
    """The rows below the head of a CSV file; raises InputError, which ends in ``remedy``, where it cannot be read."""
    try:
        with path.open(newline="", encoding="utf-8") as stream:
            return list(csv.DictReader(stream))
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        reason = getattr(error, "strerror", None) or str(error)
        raise InputError(str(path), f"it cannot be read ({reason})", remedy=remedy) from None
