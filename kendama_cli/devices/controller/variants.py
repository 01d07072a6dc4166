"""The task-space controllers that come with kendama, as declarations for the group ``kendama.controllers``.

``makes`` is called with the controller's settings and gives a TaskController (see interface.py).
"""

from kendama_cli.schema.registry import Variant

IMPEDANCE = Variant(
    "impedance",
    settings="kendama_cli.devices.controller.settings:ImpedanceControl",
    makes="kendama_cli.devices.controller.impedance:ImpedanceController",
)
FORCE = Variant(
    "force",
    settings="kendama_cli.devices.controller.settings:ForceControl",
    makes="kendama_cli.devices.controller.force:ForceController",
)
