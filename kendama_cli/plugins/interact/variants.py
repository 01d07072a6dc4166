"""The task-space controllers that come with kendama, as declarations for the group ``kendama.controllers``.

``makes`` is called with the controller's settings and gives a TaskController (see interface.py).
"""

from kendama_cli.schema.registry import Variant

IMPEDANCE = Variant(
    "impedance",
    settings="kendama_cli.plugins.interact.settings:ImpedanceControl",
    makes="kendama_cli.plugins.interact.impedance:ImpedanceController",
)
FORCE = Variant(
    "force",
    settings="kendama_cli.plugins.interact.settings:ForceControl",
    makes="kendama_cli.plugins.interact.impedance:ForceController",
)
