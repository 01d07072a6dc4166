"""Arms in MuJoCo for tests: our own iiwa with servos, and what its file can be made into."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import mujoco

from kendama_cli.plugins.mujoco.settings import MujocoHardware
from kendama_cli.settings.game import GameSettings
from kendama_cli.settings.robot import RobotSettings
from tests.shipped_conf import configured

GAME: GameSettings = configured(GameSettings, "game", "kendama")
IIWA: RobotSettings = configured(RobotSettings, "robot", "iiwa")


def nothing(_: Any) -> None:
    """Change nothing."""


def own_iiwa(folder: Path, change: Callable[[Any], None] = nothing, *, kp: float = 5000.0, lag_s: float = 0.1) -> str:
    """Write the iiwa of our URDF as a model of MuJoCo with position servos, and with ``change``; returns its path."""
    spec = mujoco.MjSpec.from_file(IIWA.path)
    spec.compiler.fusestatic = False
    for joint in spec.joints:
        joint.armature = 0.1
        servo = spec.add_actuator(name=joint.name, trntype=mujoco.mjtTrn.mjTRN_JOINT, target=joint.name)
        servo.gainprm[0] = kp
        servo.biastype = mujoco.mjtBias.mjBIAS_AFFINE
        servo.biasprm[1:3] = -kp, -lag_s * kp
    change(spec)
    spec.compile()
    file = folder / "arm.xml"
    file.write_text(spec.to_xml())
    return str(file)


def hardware(model: str, **given: Any) -> MujocoHardware:
    """The settings of ``hardware=mujoco hardware.model=MODEL`` without noise, and with what is ``given``."""
    values: dict[str, Any] = {
        "timestep_s": 0.001,
        "control_period_s": 0.004,
        "settle_s": 4.0,
        "silence_s": 20.0,
        "rope_scale": 1.0,
        "drag_scale": 1.0,
        "joint_noise_rad": 0.0,
        "ball_noise_m": 0.0,
    }
    return MujocoHardware(kind="mujoco", model=model, **{**values, **given})
