"""Episodes that a stage's log offers to others to learn from."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from kendama_cli.schema.arrays import Array


@dataclass(frozen=True)
class Episode:
    """Frames at one rate: ``vectors`` (n, k) by feature; ``success`` is None where nobody judged it."""

    vectors: Mapping[str, Array]
    success: bool | None = None

    def __len__(self) -> int:
        """Return how many frames it has."""
        return len(next(iter(self.vectors.values())))


@dataclass(frozen=True)
class Episodes:
    """Episodes of one robot and task at ``fps``; ``names`` (k) are those of each vector's numbers."""

    robot: str
    task: str
    fps: int
    names: Mapping[str, Sequence[str]]
    episodes: tuple[Episode, ...]
