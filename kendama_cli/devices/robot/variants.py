"""The robots that come with kendama, as declarations for the entry point group ``kendama.robots``.

``makes`` is called with the robot's settings, the robot model's settings and the game's, and gives a context manager of
a Robot (see interface.py).
"""

from kendama_cli.schema.registry import Variant

SIMULATED = Variant(
    "simulated",
    settings="kendama_cli.settings.hardware:SimulatedHardware",
    makes="kendama_cli.devices.robot.rebuilt:open_simulated",
)
TWIN = Variant(
    "twin",
    settings="kendama_cli.settings.hardware:TwinHardware",
    makes="kendama_cli.devices.robot.udp.twin_client:open_twin",
)
COMMAND = Variant(
    "command",
    settings="kendama_cli.settings.hardware:CommandHardware",
    makes="kendama_cli.devices.robot.udp.remote:open_command",
    needs="a controller that speaks the protocol of docs/reference/protocol.md",
)
