"""The arm of Franka Robotics, as a declaration for the entry point group ``kendama.robots``."""

from kendama_cli.schema.registry import Variant

FRANKA = Variant(
    "franka",
    settings="kendama_cli.plugins.franka.settings:FrankaHardware",
    makes="kendama_cli.plugins.franka.robot:open_franka",
    needs="an arm with the Franka Control Interface: docs/plugins/franka.md",
    library="pylibfranka",
)
