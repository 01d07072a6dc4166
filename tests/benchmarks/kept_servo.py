"""Rollouts to the first catch with a servo that an earlier transfer has found, and without, on arms of Menagerie.

``python -m tests.benchmarks.kept_servo CHECKOUT FOLDER [DRAWS [FIRST [ARM,...]]]`` places the arms and adapts the swing
as tests.benchmarks.menagerie does. The transfer of seed ``FIRST`` - 1 finds the servo of an arm, and logs it; each
draw is played without it and with it, on the same rope, drag and noise.
"""

from __future__ import annotations

import dataclasses
import os
import sys
from collections.abc import Callable
from pathlib import Path

from kendama_cli.plugins.mujoco.robot import MujocoRobot
from tests.benchmarks.imitation import OPEN_LOOP, Imitation, Row, drawn, measure
from tests.benchmarks.menagerie import ARMS, placed


def main() -> None:
    """Measure the arms, all or those that are named."""
    checkout, folder = (Path(one).resolve() for one in sys.argv[1:3])
    draws, first = (*map(int, sys.argv[3:5]), *(10, 971000)[len(sys.argv[3:5]) :])
    folder.mkdir(parents=True, exist_ok=True)
    os.chdir(folder)  # where the placed arms name their URDF
    made: dict[str, Imitation] = {}

    def player(name: str) -> Callable[[int], Row]:
        arm, _, kept = name.partition(" ")
        model = placed(checkout, folder, arm)
        words = [f"robot={arm}", "hardware=mujoco", f"hardware.model={model}", *OPEN_LOOP]
        imitation = made.setdefault(arm, Imitation(folder, words))
        log = folder / f"{arm}.mcap"

        def played(seed: int, *, servo: Path | None = None, kept_in: Path | None = None) -> Row:
            rope, drag = drawn(seed)
            hardware = dataclasses.replace(imitation.settings["hardware"], rope_scale=rope, drag_scale=drag)
            robot = MujocoRobot(imitation.robot, imitation.settings["game"], hardware)
            return imitation.play(name, seed, hardware, robot, servo=servo, log=kept_in)

        if not kept:
            return played
        if not log.exists():
            played(first - 1, kept_in=log)
        return lambda seed: played(seed, servo=log)

    arms = sys.argv[5].split(",") if len(sys.argv) > 5 else list(ARMS)
    names = [f"{arm}{kept}" for arm in arms for kept in ("", " kept")]
    measure(folder, names, range(first, first + draws), player)


if __name__ == "__main__":
    main()
