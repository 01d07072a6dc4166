"""Imitation with a visual catch, and games, on arms of MuJoCo Menagerie with their own servos, through images.

``python -m tests.benchmarks.menagerie_games CHECKOUT FOLDER perform|kendama [DRAWS [FIRST [ARM,...]]]`` places each arm
and adapts the swing as that pipeline has them (tests.benchmarks.menagerie), and plays one transfer a draw. With
``kendama`` a draw also learns a table of its own from nothing (rail), of which it plays one game: the arm itself
teaches it a single rollout. ARM+unled is its baseline, whose commands do not lead by the servo.
"""

from __future__ import annotations

import dataclasses
import os
import sys
from collections.abc import Callable
from contextlib import nullcontext
from pathlib import Path
from typing import Any, cast
from unittest import mock

from kendama_cli.devices.robot.leading import LeadingRobot
from kendama_cli.plugins.mujoco.robot import MujocoRobot
from kendama_cli.stages.learn.stage import Learn
from tests.benchmarks.imitation import Imitation, Row, drawn, measure
from tests.benchmarks.menagerie import placed
from tests.memory_context import MemoryContext

ARMS = ("iiwa", "panda")


def main() -> None:
    """Measure the arms, both or those that are named."""
    checkout, folder, pipeline = Path(sys.argv[1]).resolve(), Path(sys.argv[2]).resolve(), sys.argv[3]
    draws, first = (*map(int, sys.argv[4:6]), *(20, 970000)[len(sys.argv[4:6]) :])
    folder = folder / pipeline
    folder.mkdir(parents=True, exist_ok=True)
    os.chdir(folder)  # where the placed arms name their URDF

    def player(name: str) -> Callable[[int], Row]:
        arm, _, unled = name.partition("+")
        model = placed(checkout, folder, arm, pipeline)
        words = [f"robot={arm}", "hardware=mujoco", f"hardware.model={model}", "simulation/engine=rail"]
        words += [f"transfer.{key}=1" for key in ("games", "evaluation_rollouts", "max_rollouts")]
        imitation = Imitation(folder, words)
        settings = imitation.settings

        def played(seed: int) -> Row:
            rope, drag = drawn(seed)
            hardware = dataclasses.replace(settings["hardware"], rope_scale=rope, drag_scale=drag)
            robot = MujocoRobot(imitation.robot, settings["game"], hardware)
            learn = Learn(learn=settings["learn"], game=settings["game"])
            table = learn.run({}, cast("Any", MemoryContext(seed))).artifact if pipeline == "kendama" else None
            with mock.patch.object(LeadingRobot, "lead") if unled else nullcontext():
                return imitation.play(name, seed, hardware, robot, table)

        return played

    measure(folder, sys.argv[6].split(",") if len(sys.argv) > 6 else ARMS, range(first, first + draws), player)


if __name__ == "__main__":
    main()
