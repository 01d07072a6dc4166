"""Memory of results by the identity of their inputs: the combinations of a sweep share most of their configuration."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar

T = TypeVar("T")


class Remembered:
    """Results by what they were made of; objects count as the same where they are one object, which nobody changes."""

    def __init__(self) -> None:
        self._made: dict[tuple[object, ...], tuple[tuple[object, ...], Any]] = {}

    def once(self, what: str, of: tuple[object, ...], make: Callable[[], T]) -> T:
        """Return the result of ``make``, called once for each ``what`` and objects ``of``."""
        name = (what, *map(id, of))
        if name not in self._made:
            self._made[name] = (of, make())  # kept with the objects, whose ids are theirs as long as they live
        made: T = self._made[name][1]
        return made
