"""Imitation by the third rollout on twins that the model does not know, open loop.

``python -m tests.benchmarks.imitation FOLDER HARDWARE,... [DRAWS [FIRST]]`` adapts the bundled swing once, and plays
one transfer per twin and draw. A draw is a seed from ``FIRST`` on, of factors on the twin's rope and drag, which are
sampled from 'hard', and of the noise of readings. The motions that an aim chooses among are the model's, so that they
are simulated once, at the first miss. ``FOLDER/rows.csv`` gains a row a draw; draws that stand there are not played
again. The table that is printed has 95 % intervals (Clopper-Pearson). ``HARDWARE+servo`` leads from the first rollout
on by the servo that the transfer of seed ``FIRST`` - 1 has found.
"""

from __future__ import annotations

import csv
import dataclasses
import functools
import sys
from collections.abc import Callable, Iterable
from contextlib import AbstractContextManager, nullcontext
from pathlib import Path
from typing import Any, cast
from unittest import mock

import numpy as np
from scipy.stats import binomtest

import kendama_cli as kendama
from kendama_cli.artifacts.policy import PolicyArtifact
from kendama_cli.devices.robot.interface import Robot
from kendama_cli.settings.hardware import HardwareSettings
from kendama_cli.settings.placement import placed
from kendama_cli.settings.robot import RobotSettings
from kendama_cli.stages.transfer import aiming
from kendama_cli.stages.transfer import stage as transfer
from kendama_cli.stages.transfer.aiming import ImitationAims
from tests.log.made_logs import memory_log
from tests.memory_context import MemoryContext

ROPE_M, LENGTH_M, DRAG = 0.002, 0.40, (0.5, 2.0)
"""Ranges of conf/adapt/uncertainty/hard.yaml, and the rope of conf/game/kendama.yaml."""
MOTION_SEED = 10000
"""Seed of the search for the motion, the same for all draws."""
COLUMNS = ("hardware", "seed", "rope_scale", "drag_scale", "caught_at", "attempts", "lag_ms", "dead_ms", "sag_mm")
GAMES = {"before": "success_rate_before", "after": "success_rate_after", "learned": "rollouts", "won": "caught_rate"}
"""Further columns where a policy is played too, and their metrics."""
OPEN_LOOP = ("adapt.catch=open_loop", "transfer.observation.source=tracking")
STAGE_SETTINGS = ("transfer", "robot", "game", "learn", "camera", "lighting", "predict", "adapt", "safety")
THIRD = 3
Row = dict[str, str]


def drawn(seed: int) -> tuple[float, float]:
    """Return the factors on rope and drag of a draw: uniform, and uniform in the logarithm."""
    rope, drag = np.random.default_rng(seed).random(2)
    return 1 + (2 * rope - 1) * ROPE_M / LENGTH_M, float(DRAG[0] * (DRAG[1] / DRAG[0]) ** drag)


class Imitation:
    """Transfers of one motion, which the pipeline ``perform`` adapts in ``folder`` with the overrides ``words``."""

    def __init__(self, folder: Path, words: Iterable[str]) -> None:
        chosen = [*words, f"seed={MOTION_SEED}", "adapt.repeats=1", "transfer.imitation_repeats=0"]
        run = kendama.run("perform", chosen, until="adapt", home=folder / ".kendama", config_dir=folder)
        self._motion = run.artifact("adapt")
        self.settings = dict(kendama.configuration(chosen, config_dir=folder))
        self.robot: RobotSettings = placed(self.settings["robot"], self._motion.placement)
        game, adapt = self.settings["game"], self.settings["adapt"]
        self._aims = functools.cache(lambda: ImitationAims(self.robot, game, self._motion, adapt, MOTION_SEED))

    def play(
        self,
        name: str,
        seed: int,
        hardware: HardwareSettings,
        robot: Robot | None = None,
        policy: PolicyArtifact | None = None,
        *,
        servo: Path | None = None,
        log: Path | None = None,
    ) -> Row:
        """Play one draw and return its row; ``robot`` is in this process, None: ``hardware`` is opened as always.

        Commands lead by the servo in the log ``servo``; to ``log`` the servo is written that was found.
        """
        given = {key: self.settings[key] for key in STAGE_SETTINGS}
        given["transfer"] = dataclasses.replace(given["transfer"], servo=None if servo is None else str(servo))
        ctx = MemoryContext(seed)
        opened: AbstractContextManager[object] = nullcontext()
        if robot is not None:
            opened = mock.patch.object(transfer, "open_robot", return_value=nullcontext(robot))
        with mock.patch.object(aiming, "ImitationAims", side_effect=lambda *_: self._aims()), opened:
            stage = transfer.Transfer(hardware=hardware, **given)
            inputs = {"adapt": self._motion} | ({} if policy is None else {"learn": policy})
            metrics = stage.run(inputs, cast("Any", ctx)).metrics
        if log is not None:
            written = memory_log()
            for topic, t_s, message in ctx.log.messages:
                if topic == "/transfer/servo":
                    written.write(topic, t_s, message)
            plain = {key: dataclasses.asdict(value) for key, value in {**given, "hardware": hardware}.items()}
            written.finish(log, stage="transfer", settings=plain, metrics={})
        rope, drag = drawn(seed)
        values: list[Any] = [name, seed, round(rope, 5), round(drag, 4)]
        values += [metrics.get(key) for key in ("imitation_caught_at", "imitation_attempts")]
        for key, factor in (("servo_lag_s", 1e3), ("servo_dead_time_s", 1e3), ("servo_sag_mm", 1.0)):
            value = metrics.get(key)
            values.append(None if value is None else round(factor * float(value), 1))
        row = dict(zip(COLUMNS, values, strict=True)) | {key: metrics.get(metric) for key, metric in GAMES.items()}
        return {key: "" if value is None else str(value) for key, value in row.items()}


def measure(
    folder: Path, names: Iterable[str], seeds: Iterable[int], player: Callable[[str], Callable[[int], Row]]
) -> None:
    """Play what is missing in ``folder/rows.csv``, and print how many draws were caught by the third rollout.

    ``player`` returns the function that plays one draw of a name.
    """
    folder.mkdir(parents=True, exist_ok=True)
    table = folder / "rows.csv"
    rows = list(csv.DictReader(table.open())) if table.exists() else []
    for name in names:
        known = {int(one["seed"]) for one in rows if one["hardware"] == name}
        missing = [seed for seed in seeds if seed not in known]
        if not missing:
            continue
        played = player(name)
        for seed in missing:
            rows.append(played(seed))
            with table.open("w", newline="") as stream:
                writer = csv.DictWriter(stream, [*COLUMNS, *GAMES], lineterminator="\n")
                writer.writeheader()
                writer.writerows(rows)
    for name in names:
        at = [float(one["caught_at"] or "inf") for one in rows if one["hardware"] == name]
        caught = sum(one <= THIRD for one in at)
        low, high = binomtest(caught, len(at)).proportion_ci()
        sys.stdout.write(f"{name}: {caught} of {len(at)} [{low:.2f}, {high:.2f}]; rollouts {at}\n")


def main() -> None:
    """Measure the twins that are named."""
    folder, names = Path(sys.argv[1]).resolve(), sys.argv[2].split(",")
    draws, first = (*map(int, sys.argv[3:5]), *(20, 960000)[len(sys.argv[3:5]) :])
    (folder / "conf").mkdir(parents=True, exist_ok=True)
    imitation = Imitation(folder, OPEN_LOOP)

    def player(name: str) -> Callable[[int], Row]:
        hardware, _, known = name.partition("+")
        twin = kendama.configuration([f"hardware={hardware}"])["hardware"]

        def played(seed: int, servo: Path | None = None, log: Path | None = None) -> Row:
            rope, drag = drawn(seed)
            body = twin.imperfection
            body = dataclasses.replace(body, rope_scale=rope * body.rope_scale, drag_scale=drag * body.drag_scale)
            changed = dataclasses.replace(twin, imperfection=body)
            return imitation.play(name, seed, changed, servo=servo, log=log)

        if not known:
            return played
        kept = folder / f"{hardware}.mcap"
        if not kept.exists():
            played(first - 1, log=kept)
        return lambda seed: played(seed, servo=kept)

    measure(folder, names, range(first, first + draws), player)


if __name__ == "__main__":
    main()
