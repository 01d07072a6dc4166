"""Games on a twin with and without the lead by its identified servo, one a table, on the same tables and seeds.

``python -m tests.benchmarks.led_games HARDWARE [TABLES [FIRST [ROWS.csv]]]`` learns a table a seed from ``FIRST`` on
(rail), identifies the servo once by the excitation of 'identify', and plays one game a table and arm, tracked. The line
that is printed has exact 95 % intervals, and how many tables were won one way alone; ``ROWS.csv`` gains a row a table.
"""

from __future__ import annotations

import csv
import dataclasses
import sys
from pathlib import Path
from typing import Any, cast

import numpy as np

import kendama_cli as kendama
from kendama_cli.artifacts.proportion import success_interval
from kendama_cli.control.game_runner import GameBuilder, GameSetup
from kendama_cli.control.open_observer import CameraSetup
from kendama_cli.devices.robot.leading import LeadingRobot
from kendama_cli.devices.robot.open_robot import open_robot
from kendama_cli.identification.servo import fit_servo
from kendama_cli.learning.learners import make_policy
from kendama_cli.plugins.identification.excitation import excitation
from kendama_cli.plugins.identification.recording import play
from kendama_cli.stages.learn.stage import Learn
from tests.memory_context import MemoryContext

EXCITED_S = 8.0


def games(hardware: str, tables: int, first: int) -> list[dict[str, Any]]:
    """Play one game with and one without the lead on each table; returns a row a table."""
    made = kendama.configuration(["simulation/engine=rail", f"hardware={hardware}"])
    transfer = dataclasses.replace(
        made["transfer"], observation=dataclasses.replace(made["transfer"].observation, source="tracking")
    )
    cameras = CameraSetup(made["camera"], made["lighting"], made["predict"])
    builder = GameBuilder(GameSetup(made["robot"], made["game"], made["learn"], transfer, cameras))
    rows = []
    with open_robot(made["hardware"], made["robot"], made["game"]) as bare:
        motion = excitation(
            builder.arm,
            made["game"],
            made["identify"],
            duration_s=EXCITED_S,
            period_s=bare.period_s,
            rng=np.random.default_rng(first),
        )
        shown = play(bare, motion, first)
        servo = fit_servo(builder.arm, shown.sent_rad, shown.position_rad, bare.period_s)
        robot = LeadingRobot(bare, builder.arm)
        with builder.open(robot, seed=first) as runner:
            for seed in range(first, first + tables):
                ctx = cast("Any", MemoryContext(seed))
                table = Learn(learn=made["learn"], game=made["game"]).run({}, ctx).artifact
                row: dict[str, Any] = {"hardware": hardware, "seed": seed}
                row["lag_ms"] = 0.0 if servo is None else round(1e3 * float(np.median(servo.lag_s)), 1)
                for name, led in (("plain", None), ("led", servo)):
                    robot.lead(led)
                    game = runner.play(make_policy(table, made["learn"]), seed=seed)
                    row |= {f"{name}_swung_up": game.swung_up, f"{name}_caught": game.caught}
                print(row, flush=True)
                rows.append(row)
    return rows


def line(rows: list[dict[str, Any]]) -> str:
    """Return a table's line of the rows of one twin."""
    cells = [f"`{rows[0]['hardware']}`", f"{rows[0]['lag_ms']} ms"]
    for what in ("swung_up", "caught"):
        for name in ("plain", "led"):
            won = sum(row[f"{name}_{what}"] for row in rows)
            ends = success_interval(won, len(rows))
            cells.append(f"{won} of {len(rows)} [{ends.low:.2f}, {ends.high:.2f}]")
    for one, other in (("led", "plain"), ("plain", "led")):
        cells.append(str(sum(row[f"{one}_caught"] and not row[f"{other}_caught"] for row in rows)))
    return "| " + " | ".join(cells) + " |"


if __name__ == "__main__":
    chosen = (*sys.argv[1:], *("beyond_lag", "20", "21000")[len(sys.argv) - 1 :])
    played = games(chosen[0], int(chosen[1]), int(chosen[2]))
    print(line(played))
    if len(chosen) > 3:
        file = Path(chosen[3])
        known = file.exists()
        with file.open("a", newline="") as out:
            writer = csv.DictWriter(out, list(played[0]), lineterminator="\n")
            if not known:
                writer.writeheader()
            writer.writerows(played)
