"""Makes the task-space controller that the configuration names."""

from __future__ import annotations

from kendama_cli.devices.controller.interface import TaskController
from kendama_cli.motion.task_settings import CONTROLLERS, ControllerSettings


def make_controller(settings: ControllerSettings) -> TaskController:
    """The controller of the kind that ``settings`` choose."""
    made: TaskController = CONTROLLERS.maker(settings.kind)(settings)
    return made
