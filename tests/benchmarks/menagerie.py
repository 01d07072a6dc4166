"""Imitation by the third rollout on the arms of MuJoCo Menagerie, with their own servos, open loop.

``python -m tests.benchmarks.menagerie CHECKOUT FOLDER [DRAWS [FIRST [ARM,...]]]`` makes in ``FOLDER``, per arm, a URDF
of its model ('kendama robot urdf'), a placement ('kendama robot place'), and the swing adapted to it; then it plays one
transfer per draw, as tests.benchmarks.imitation does. Nothing of rope and drag, nor of the servos, is known to it. The
arm in MuJoCo runs in this process, not in one of its own.
"""

from __future__ import annotations

import dataclasses
import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

from kendama_cli.plugins.mujoco.files import arm_files
from kendama_cli.plugins.mujoco.robot import MujocoRobot
from tests.benchmarks.imitation import OPEN_LOOP, Imitation, Row, drawn, measure

ARMS = {
    "iiwa": ("kuka_iiwa_14", [1.484, 1.484, 1.745, 1.309, 2.269, 2.356, 2.356]),
    "panda": ("franka_emika_panda", [2.175] * 4 + [2.61] * 3),
    "xarm7": ("ufactory_xarm7", [3.14] * 7),
    "ur5e": ("universal_robots_ur5e", [3.14] * 6),
    "ur10e": ("universal_robots_ur10e", [2.09] * 2 + [3.14] * 4),
}
"""Folder of the model, and the maker's speed limits."""
OTHERS = {
    "iiwa": "robot.effort_nm=[320,320,176,176,110,40,40]",
    "panda": "robot.acceleration_rad_s2=[15,7.5,10,12.5,15,20,20]",
}
"""The maker's limits that the model lacks, and else a rule of thumb would give."""


def command(folder: Path, *words: str) -> None:
    """Run kendama in ``folder``."""
    subprocess.run([str(Path(sys.executable).with_name("kendama")), *words], cwd=folder, check=True)


def placed(checkout: Path, folder: Path, arm: str, pipeline: str = "perform") -> Path:
    """Return the model of ``arm``, which stands under its name where 'robot place' finds it for ``pipeline``."""
    maker, speeds = ARMS[arm]
    (model,) = arm_files(checkout / maker)
    if not (folder / f"conf/robot/{arm}.yaml").exists():
        command(folder, "robot", "urdf", str(model), "-o", f"{arm}.urdf")
        given = [f"robot.velocity_rad_s={speeds}".replace(" ", ""), *([OTHERS[arm]] if arm in OTHERS else [])]
        given = ["robot=urdf", f"robot.path={arm}.urdf", *given, "-o", f"conf/robot/{arm}.yaml"]
        command(folder, "robot", "place", "-p", pipeline, *given)
    return model


def main() -> None:
    """Measure the arms, all or those that are named."""
    checkout, folder = (Path(one).resolve() for one in sys.argv[1:3])
    draws, first = (*map(int, sys.argv[3:5]), *(20, 950000)[len(sys.argv[3:5]) :])
    folder.mkdir(parents=True, exist_ok=True)
    os.chdir(folder)  # where the placed arms name their URDF

    def player(arm: str) -> Callable[[int], Row]:
        model = placed(checkout, folder, arm)
        imitation = Imitation(folder, [f"robot={arm}", "hardware=mujoco", f"hardware.model={model}", *OPEN_LOOP])

        def played(seed: int) -> Row:
            rope, drag = drawn(seed)
            hardware = dataclasses.replace(imitation.settings["hardware"], rope_scale=rope, drag_scale=drag)
            robot = MujocoRobot(imitation.robot, imitation.settings["game"], hardware)
            return imitation.play(arm, seed, hardware, robot)

        return played

    measure(folder, sys.argv[5].split(",") if len(sys.argv) > 5 else list(ARMS), range(first, first + draws), player)


if __name__ == "__main__":
    main()
