"""What a robot is opened for: a game with cup, rope and ball, or an interaction of its probe with a scene."""

from __future__ import annotations

from kendama_cli.motion.task_settings import InteractionTask
from kendama_cli.settings.game import GameSettings

Task = GameSettings | InteractionTask
"""A simulated robot builds its world from it; a real one stands in that world already."""
