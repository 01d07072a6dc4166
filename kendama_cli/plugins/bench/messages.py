"""Messages that bench logs."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass


@dataclass(frozen=True)
class EpisodeMessage:
    """One episode of learning."""

    index: int
    explored: bool
    total_reward: float
    steps: int


TOPICS: Mapping[str, type] = {"/bench/episode": EpisodeMessage}
