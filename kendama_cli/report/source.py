"""Source of a report: the log of one stage, with those of its topics that exist."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
import pandas as pd

from kendama_cli.errors import InputError
from kendama_cli.log.decode import MIGRATE, columns_of
from kendama_cli.log.reader import LogFile, TypedMessages
from kendama_cli.schema.renames import SINCE, renamed_anywhere

M = TypeVar("M")


def is_number(value: Any) -> bool:
    """Return True for a metric that has a size; yes and no have none."""
    return isinstance(value, int | float) and not isinstance(value, bool)


class StageLog:
    """The tables, settings and metrics of one stage's log; a topic without messages is an empty table.

    ``topics`` limits what is kept in memory (None: all).
    """

    def __init__(self, path: Path | str, topics: Collection[str] | None = None) -> None:
        self.path = Path(path)
        self._file = LogFile(path, topics)
        facts = self._file.stage
        self.settings: Mapping[str, Any] = facts.get("settings", {})
        self.metrics: Mapping[str, Any] = facts.get("metrics", {})

    def table(self, topic: str, kind: type) -> pd.DataFrame:
        """Return the messages of ``topic``, with the columns that ``kind`` has; without rows where the log has none.

        Raises InputError where the topic holds messages of another type.
        """
        if self._is_absent(topic):
            return pd.DataFrame(columns=list(columns_of(kind)))
        return self._file.table(topic, kind)

    def messages(self, topic: str, kind: type[M]) -> TypedMessages[M]:
        """Return the messages of ``topic`` as ``kind``; none where the log has none."""
        if self._is_absent(topic):
            return TypedMessages(np.empty(0), ())
        return self._file.messages(topic, kind)

    def topics_under(self, prefix: str) -> list[str]:
        """Return the topics that begin with ``prefix``, sorted."""
        return [topic for topic in self._file.topics if topic.startswith(prefix)]

    def setting(self, *names: str, default: float | None = None) -> float:
        """Return a number in the settings by the last parts of its name (``rope``, ``length_m``), wherever it stands.

        Raises InputError where it is not there and there is no ``default``.
        """
        found = _find(self.settings, names)
        if isinstance(found, int | float):
            return float(found)
        if default is None:
            raise self._missing(names)
        return default

    def group(self, name: str) -> Mapping[str, Any]:
        """Return the group ``name`` of the settings, wherever it stands; raises InputError where it is not there."""
        found = _find(self.settings, (name,))
        if not isinstance(found, Mapping):
            raise self._missing((name,))
        return found

    def _is_absent(self, topic: str) -> bool:
        """Return True for a topic without messages; raises InputError where they stand under an older name."""
        for one in self._file.topics if topic not in self._file.topics else ():
            if renamed_anywhere("topic", one) == topic:
                raise InputError(str(self.path), f"its topic '{one}' is '{topic}' since {SINCE}", remedy=MIGRATE)
        return topic not in self._file.topics

    def _missing(self, names: tuple[str, ...]) -> InputError:
        problem = f"has no setting '{'.'.join(names)}'"
        return InputError(str(self.path), problem, remedy="run the stage again with --force")


def _find(settings: Any, names: tuple[str, ...]) -> Any:
    if not isinstance(settings, Mapping):
        return None
    value: Any = settings
    for name in names:
        value = value.get(name) if isinstance(value, Mapping) else None
    if value is not None:
        return value
    for nested in settings.values():
        value = _find(nested, names)
        if value is not None:
            return value
    return None
