"""Small tables of a person's own, row by row."""

from __future__ import annotations

import csv
from pathlib import Path

from kendama_cli.errors import InputError


def csv_rows(path: Path, remedy: str) -> list[dict[str, str]]:
    """Read the rows below the header of a CSV file; raises InputError, ending in ``remedy``, if it cannot be read."""
    try:
        with path.open(newline="", encoding="utf-8") as stream:
            return list(csv.DictReader(stream))
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        reason = getattr(error, "strerror", None) or str(error)
        raise InputError(str(path), f"it cannot be read ({reason})", remedy=remedy) from None
