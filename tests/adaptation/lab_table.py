"""Catches of a person's recorded swing in `hard` and in `lab`, by arm, as CSV.

    python -m tests.adaptation.lab_table RECORDING TABLE.csv [SIMULATIONS [MINUTES [CONDITION ...]]]

The swing (RECORDING as in ``phones.person_swing``) is played as recorded, turned by 20 degrees, and mirrored and turned
by -45, at TAU, which `adapt` finds on each of the arms, with the visual catch. Conditions: `hard`, `lab`, and `lab`
with a restitution of 0.5 to 0.6, with a cup that is still and with one that gives with the ball by GIVING_M_S.

Simulations that stand in the table are left out, and after MINUTES no further one is begun. At the end the rates of all
arms are printed.
"""

from __future__ import annotations

import csv
import dataclasses
import functools
import itertools
import sys
import time
from pathlib import Path

import numpy as np

from kendama_cli.adaptation.catch_family import CatchFamily, playable_tilt
from kendama_cli.adaptation.search_record import MOUTH_SHARE, MotionVariation, PerturbedSimulations, Trial
from kendama_cli.adaptation.settings import AdaptSettings
from kendama_cli.artifacts.demonstration import Demonstration
from kendama_cli.artifacts.proportion import success_interval
from kendama_cli.motion.dmp.averaging import encode_demonstrations
from kendama_cli.motion.dmp.heading import heading_turn, swing_heading_rad, turned_plan
from kendama_cli.schema.settings import build
from kendama_cli.settings.placement import turned
from kendama_cli.simulation.dart.world import ArmWorld
from kendama_cli.stages.adapt.trials import Trials
from tests.memory_context import MemoryContext
from tests.motion.swings import settings as encode_settings
from tests.plugins.phone.phones import person_swing
from tests.robot_model.test_model import ready
from tests.shipped_conf import plain
from tests.simulation.dart.bench_robot import adapt_values, kendama_game

TAU = 1.042
SEED = 31000
ARMS = ("pa10", "iiwa", "ur10", "panda", "xarm7", "ur5", "fr3")
POSES = {"recorded": (1.0, 0.0), "turned": (1.0, 20.0), "mirrored": (-1.0, -45.0)}
"""Factor on the swing's direction, and the turn about the vertical [deg]."""
GIVING_M_S = 0.3
CONDITIONS: dict[str, tuple[str, float]] = {
    "hard": ("hard", 0.0),
    "lab": ("lab", 0.0),
    "bouncing": ("lab", 0.0),
    "bouncing, giving": ("lab", GIVING_M_S),
}
"""Uncertainty, and the speed with which the cup gives [m/s]."""
BOUNCING = (0.5, 0.6)
COLUMNS = ("arm", "pose", "condition", "simulation", "caught", "miss_mm")


class Played:
    """The swing in one pose on one arm under one condition."""

    def __init__(self, recording: Path, simulations: int, arm: str, pose: str, condition: str) -> None:
        uncertainty, giving_m_s = CONDITIONS[condition]
        made = build(AdaptSettings, adapt_values() | {"uncertainty": plain("adapt/uncertainty", uncertainty)}, "adapt")
        declared = made.uncertainty
        if condition.startswith("bouncing"):
            declared = dataclasses.replace(declared, restitution=BOUNCING)
        correction = dataclasses.replace(made.correction, contact_speed_m_s=giving_m_s)
        settings = dataclasses.replace(made, uncertainty=declared, correction=correction)
        plan = encode_demonstrations([_posed(recording, pose)], encode_settings())
        heading_rad, game = swing_heading_rad(plan), kendama_game()
        world = ArmWorld(turned(ready(arm), -heading_rad), game)
        plan, _ = playable_tilt(world.arm, turned_plan(plan, -heading_rad), settings)
        family = CatchFamily(world.arm, plan, settings.lead_in_m_s2)
        mouth_m = MOUTH_SHARE * game.cup.radius_m
        self._trials = Trials(world, family, settings, mouth_m=mouth_m, ctx=MemoryContext(SEED))
        rng = np.random.default_rng(SEED)
        self._simulations = PerturbedSimulations.seeded(declared, game.rope.length_m, simulations, rng)
        self.forbidden = family.limit(MotionVariation(TAU))

    def rollout(self, simulation: int) -> tuple[bool, float | None]:
        """Return the catch and the miss [m] in one simulation."""
        trial = Trial("confirm", MotionVariation(TAU), simulation)
        result, _ = self._trials.simulate(trial.variation, self._simulations.perturbation(trial))
        return result.caught, result.signed_miss_m


def _posed(recording: Path, pose: str) -> Demonstration:
    t_s, place_m = person_swing(recording)
    forward, turn_deg = POSES[pose]
    path_m = (place_m - place_m[0]) * [forward, 1.0, 1.0]
    return Demonstration(pose, t_s, path_m @ heading_turn(np.radians(turn_deg)).T)


def report(table: Path) -> None:
    """Print the catches by condition: of all, and of the worst arm and pose."""
    rows = list(csv.DictReader(table.open()))
    for condition in CONDITIONS:
        own = [one for one in rows if one["condition"] == condition]
        groups = [
            [one["caught"] == "True" for one in own if (one["arm"], one["pose"]) == group]
            for group in dict.fromkeys((one["arm"], one["pose"]) for one in own)
        ]
        if not own:
            continue
        caught, (fewest, of) = sum(map(sum, groups)), min((sum(one), len(one)) for one in groups)
        interval = success_interval(caught, len(own))
        print(
            f"{condition}: {caught} of {len(own)} [{interval.low:.2f}, {interval.high:.2f}] in {len(groups)} pairs of "
            f"arm and pose, worst {fewest} of {of}"
        )


def main() -> None:
    """Run the simulations that are missing, the same one of all arms, poses and conditions before the next."""
    recording, table = Path(sys.argv[1]), Path(sys.argv[2])
    simulations, minutes = ([int(one) for one in sys.argv[3:5]] + [40, 600][len(sys.argv) - 3 :])[:2]
    end_s = time.monotonic() + 60 * minutes
    if not table.exists():
        table.write_text(",".join(COLUMNS) + "\n")
    made = {tuple(one.values())[:4] for one in csv.DictReader(table.open())}
    played = functools.cache(functools.partial(Played, recording, simulations))
    for simulation, arm, pose, condition in itertools.product(
        range(simulations), ARMS, POSES, sys.argv[5:] or CONDITIONS
    ):
        if (arm, pose, condition, str(simulation)) in made or time.monotonic() > end_s:
            continue
        one = played(arm, pose, condition)
        caught, miss_m = (False, None) if one.forbidden is not None else one.rollout(simulation)
        miss = "" if miss_m is None else f"{1e3 * miss_m:.1f}"
        with table.open("a") as file:
            csv.writer(file).writerow([arm, pose, condition, simulation, caught, miss])
    report(table)


if __name__ == "__main__":
    main()
