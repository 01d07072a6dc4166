"""An arm and cameras in MuJoCo, as declarations for the groups ``kendama.robots`` and ``kendama.cameras``."""

from kendama_cli.schema.registry import Variant

MUJOCO = Variant(
    "mujoco",
    settings="kendama_cli.plugins.mujoco.settings:MujocoHardware",
    makes="kendama_cli.plugins.mujoco.process:open_mujoco",
    needs="a MuJoCo model of the arm with its actuators: docs/plugins/mujoco.md",
    library="mujoco",
)
CAMERA = Variant(
    "mujoco",
    settings="kendama_cli.plugins.mujoco.settings:MujocoCamera",
    makes="kendama_cli.plugins.mujoco.camera:open_mujoco_cameras",
    needs="OpenGL, which EGL brings without a display: docs/plugins/mujoco.md",
    library="mujoco",
)
