"""What the learners that come with kendama need beside the settings that all of them share (``LearnSettings``)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from kendama_cli.learning.exploration_settings import HarmonicExploration


@dataclass(frozen=True)
class TableSettings:
    """SARSA(lambda) and its kin on a table of values; ``learn.alpha``, ``learn.gamma`` and so on are its constants."""

    kind: Literal["table"]


@dataclass(frozen=True)
class HarmonicSearchSettings:
    """The null model: harmonics are drawn until one reaches the goal, and that one is replayed without a table."""

    kind: Literal["harmonic_search"]
    harmonic: HarmonicExploration
