"""The arm of Franka Robotics, as a declaration for the entry point group ``kendama.robots``."""

from kendama_cli.schema.registry import Variant

FRANKA = Variant(
    "franka",
    settings="kendama_cli.devices.robot.franka.settings:FrankaHardware",
    makes="kendama_cli.devices.robot.franka.robot:open_franka",
)
