"""KUKA's arms under RSI, as a declaration for the entry point group ``kendama.robots``."""

from kendama_cli.schema.registry import Variant

RSI = Variant(
    "rsi",
    settings="kendama_cli.plugins.kuka_rsi.settings:RsiHardware",
    makes="kendama_cli.plugins.kuka_rsi.robot:open_rsi",
    needs="a KUKA controller with RobotSensorInterface: docs/plugins/kuka_rsi.md",
)
