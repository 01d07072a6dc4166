"""The registry of learners, and what the settings of every learner have; nothing heavy is imported."""

from __future__ import annotations

from typing import Protocol

from kendama_cli.schema.registry import Registry

LEARNERS = Registry("kendama.learners", "learner")


class LearnerSettings(Protocol):
    """Fields that the settings of every learner have beside fields of their own."""

    @property
    def kind(self) -> str:
        """Return the name under which the learner is registered."""
