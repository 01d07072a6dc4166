"""The controllers that ``interact.controller`` can choose."""

from __future__ import annotations

from kendama_cli.devices.controller.force import ForceController
from kendama_cli.devices.controller.impedance import ImpedanceController
from kendama_cli.devices.controller.interface import TaskController
from kendama_cli.motion.task_settings import ControllerSettings, ForceControl


def make_controller(settings: ControllerSettings) -> TaskController:
    """The controller of this kind."""
    if isinstance(settings, ForceControl):
        return ForceController(settings)
    return ImpedanceController(settings)
