"""Making of the task-space controller that the configuration names."""

from __future__ import annotations

from kendama_cli.plugins.interact.interface import TaskController
from kendama_cli.plugins.interact.settings import CONTROLLERS, ControllerSettings


def make_controller(settings: ControllerSettings) -> TaskController:
    """Return the controller of the kind that ``settings`` choose."""
    made: TaskController = CONTROLLERS.maker(settings.kind)(settings)
    return made
