"""Finds the placements in conf/robot/: ``python data/place_arms.py pa10 [iiwa ...]`` prints each, ready to be pasted.

What an arm shall be able to do there, with no regard to any recording: straight ways between random places of a box of
0.54 m x 0.36 m in the swing plane, one after the other, at 1.2 m/s and 8 m/s^2; and the line on which the swing-up is
learned and the ball caught, +-0.43 m along x, which may take more of the limits.
"""

from __future__ import annotations

import sys
from itertools import pairwise
from pathlib import Path

import numpy as np
import yaml

from kendama_cli.config.site import find_site
from kendama_cli.pipeline.inputs import resolve_files
from kendama_cli.robot_model.model import RobotModel
from kendama_cli.robot_model.placement.find_placement import current_placement
from kendama_cli.robot_model.placement.placement_search import Demand, PlacementProblem, line_demands, search
from kendama_cli.schema.settings import build
from kendama_cli.settings.game import GameSettings
from kendama_cli.settings.placement import LineSettings
from kendama_cli.settings.robot import RobotSettings

CONF = Path(__file__).resolve().parents[1] / "conf"
FAMILY, LEGS = 6, 4
SPEED_M_S, ACCELERATION_M_S2 = 1.2, 8.0
STEP_M = 0.025
LINES = {"pa10": (2.0, 14.0, 0.75), "ur10": (2.0, 14.0, 0.75)}
"""Speed [m/s], acceleration [m/s^2] and weight of the line, for arms that can run it as learning and catching wish."""
SLOW_LINE = (1.5, 8.0, 0.5)
HALF_WIDTH_M, BRAKING_M_S2 = 0.43, 12.6


def ways(rng: np.random.Generator) -> Demand:
    """From home along ``LEGS`` straight ways between random places; slow at their ends alone."""
    places = np.vstack([np.zeros(3), rng.uniform([-0.21, -0.01, -0.16], [0.33, 0.01, 0.2], (LEGS, 3))])
    path, speeds = [places[:1]], [np.zeros(1)]
    for start, end in pairwise(places):
        count = max(3, round(float(np.linalg.norm(end - start)) / STEP_M))
        shares = np.arange(1, count + 1)[:, None] / count
        path.append(start + shares * (end - start))
        speeds.append(np.where(np.arange(count) < count - 1, SPEED_M_S, 0.0))
        speeds[-1][0] = 0.0
    # a leg's steps are not quite STEP_M long: a little slower or faster there does not matter
    return Demand(np.vstack(path), STEP_M, np.concatenate(speeds), ACCELERATION_M_S2, 1.0, 1.0)


def main() -> None:
    """Search for every arm named on the command line."""
    game = build(GameSettings, yaml.safe_load((CONF / "game/kendama.yaml").read_text()), "game")
    rng = np.random.default_rng(20)
    family = [ways(rng) for _ in range(FAMILY)]
    for name in sys.argv[1:]:
        values = yaml.safe_load((CONF / f"robot/{name}.yaml").read_text())
        robot = resolve_files(build(RobotSettings, values, "robot"), "robot", find_site().data_roots)
        arm = RobotModel(robot, game.cup, game.gravity_m_s2)
        speed, acceleration, weight = LINES.get(name, SLOW_LINE)
        line = LineSettings(HALF_WIDTH_M, speed, acceleration)
        demands = [*line_demands(line, weight, braking_m_s2=BRAKING_M_S2), *family]
        problem = PlacementProblem(arm, game, demands)
        best = search(problem, current_placement(arm), rng=np.random.default_rng(3), effort=1.0)
        placement = problem.placement(best.place)
        lines = [f"# {name}: {best.value:.3f}"]
        for field in ("base_position_m", "base_heading_rad", "home_rad", "redundancy_weights"):
            value = getattr(placement, field)
            lines.append(f"{field}: {list(value) if isinstance(value, tuple) else value}")
        lines += ["tool:", f"  handle_m: {list(placement.handle_m)}", f"  cup_axis: {list(placement.cup_axis)}", ""]
        sys.stdout.write("\n".join(lines))
        sys.stdout.flush()


if __name__ == "__main__":
    main()
