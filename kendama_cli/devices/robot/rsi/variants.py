"""KUKA's arms under RSI, as a declaration for the entry point group ``kendama.robots``."""

from kendama_cli.schema.registry import Variant

RSI = Variant(
    "rsi",
    settings="kendama_cli.devices.robot.rsi.settings:RsiHardware",
    makes="kendama_cli.devices.robot.rsi.robot:open_rsi",
)
