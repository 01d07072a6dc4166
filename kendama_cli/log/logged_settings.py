"""Settings with which a stage was logged, as this version has them."""

from __future__ import annotations

from pathlib import Path
from typing import Any, TypeVar

from kendama_cli.errors import ConfigError, InputError
from kendama_cli.schema.settings import build

T = TypeVar("T")


def logged_settings(kind: type[T], value: Any, node: str, path: Path) -> T:
    """``value``, the settings of ``node`` in the log at ``path``; raises InputError for those of another version."""
    try:
        return build(kind, value, node)
    except ConfigError as wrong:
        problem = f"its settings '{node}' are of another version ({wrong})"
        raise InputError(str(path), problem, remedy="run the stage again") from None
