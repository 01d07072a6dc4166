"""An arm in MuJoCo, as a declaration for the entry point group ``kendama.robots``."""

from kendama_cli.schema.registry import Variant

MUJOCO = Variant(
    "mujoco",
    settings="kendama_cli.plugins.mujoco.settings:MujocoHardware",
    makes="kendama_cli.plugins.mujoco.process:open_mujoco",
    needs="a MuJoCo model of the arm with its actuators: docs/plugins/mujoco.md",
)
