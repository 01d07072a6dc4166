"""Results of every engine that uses a law, as JSON: run in a copy of the tree in which the law was changed."""

from __future__ import annotations

import json
from collections.abc import Callable

import numpy as np

import kendama_cli
from kendama_cli.gym import SwingUp, SwingUpVector
from kendama_cli.learning.learners import begin_learner
from kendama_cli.learning.state import SwingState
from kendama_cli.physics.rope import RopeLaw, rope_pull
from kendama_cli.plugins.learners.swing_model import NODES
from kendama_cli.plugins.learners.swing_planner import SwingPlanner
from kendama_cli.schema.settings import build
from kendama_cli.settings.game import GameSettings
from kendama_cli.simulation.dart.hand_world import HandWorld
from kendama_cli.simulation.dart.world import ArmWorld
from kendama_cli.simulation.swingup.engine import catch_limiter
from kendama_cli.simulation.swingup.environment import SwingUpEnvironment
from kendama_cli.simulation.swingup.rail import CompiledRail
from tests.learning.settings_files import game_settings, learn_settings
from tests.shipped_conf import plain
from tests.simulation.dart.bench_robot import bench_arm

GAME = game_settings()
STRETCHED_M = 0.004
HOLD_S, ACTIONS = 0.05, 6
LARGEST_M_S2 = 3.25
"""The largest action of the environments' task."""


def rollout(learner: str) -> float:
    """The sum of what a learner has learned of three rollouts on the rail, or of its rewards where it learns none."""
    chosen = learn_settings("easy", f"learn/learner={learner}")
    environment, actor = SwingUpEnvironment(chosen, GAME), begin_learner(chosen)
    rng, total = np.random.default_rng(3), 0.0
    for _ in range(3):
        actor.begin_rollout(rng)
        played = environment.roll_out(actor, environment.noise(rng))
        total += actor.end_rollout(played.outcome, played.final).reward if learner == "random" else 0.0
        if learner == "sarsa":
            actor.end_rollout(played.outcome, played.final)
            total += float(actor.table.sum())
    return total


def rewards() -> dict[str, float]:
    """Returns of equal actions in one environment and in many, and of learners with and without a table."""
    one, many = SwingUp(["simulation/engine=rail"], hold_s=HOLD_S), SwingUpVector(2, hold_s=HOLD_S)
    one.reset(seed=1)
    many.reset(seed=1)
    return {
        "one": float(sum(one.step(4)[1] for _ in range(ACTIONS))),
        "many": float(sum(many.step(np.array([4, 4]))[1][0] for _ in range(ACTIONS))),
        "sarsa": rollout("sarsa"),
        "random": rollout("random"),
    }


def tensions() -> dict[str, float]:
    """The pull [N] on a ball at rest that stretches its rope by STRETCHED_M, in every world that has one."""
    length_m = GAME.rope.length_m + STRETCHED_M
    rail = CompiledRail(GAME, 0.001)
    rail.start(SwingState(0.0, 0.0, 0.0, 0.0))
    rail.numbers[2] = -length_m
    rail.step(0.0)
    found = {"rail": rail.tension_n}
    arm = ArmWorld(bench_arm(), GAME)
    found["arm"] = pulled(arm, lambda: arm.step(arm.arm.home_rad, np.zeros(7), np.zeros(7)), arm.ball.tie_m, length_m)
    hand = HandWorld(GAME)
    found["hand"] = pulled(hand, lambda: hand.step(np.zeros(4)), hand.ball.tie_m, length_m)
    values = plain("game", "kendama") | {"cup": plain("game/cup", "side")}
    side = HandWorld(build(GameSettings, values, "game"))
    found["side"] = pulled(side, lambda: side.step(np.zeros(4)), np.array(side.ball.game.cup.tie_m), length_m)
    found["plain"] = rope_pull(RopeLaw.of(GAME), (0.0, 0.0, -length_m), (0.0, 0.0, 0.0)).tension_n
    return found


def pulled(world: ArmWorld | HandWorld, step: Callable[[], None], tie_m: np.ndarray, length_m: float) -> float:
    world.ball.put((tie_m - [0.0, 0.0, length_m]).tolist(), [0.0, 0.0, 0.0])
    step()
    return world.ball.tension_n


def limits() -> dict[str, float]:
    """The speed [m/s] that a cup at rest has after the largest action, and what a planner finds with it."""
    hard = learn_settings("hard", "learn/learner=model_based")
    many = SwingUpVector(1, hold_s=HOLD_S)
    many.reset(seed=1)
    found = {"many": float(many.step(np.array([4]))[0][0, 1])}
    for engine in ("rail", "dart"):
        one = SwingUp([f"simulation/engine={engine}"], hold_s=HOLD_S)
        one.reset(seed=1)
        found[engine] = float(one.step(4)[0][1])
    planner = SwingPlanner(hard)
    pushed = np.zeros((1, 4, NODES))
    pushed[0, 3] = -2.5
    costs = planner._costs(np.array([[4.0, 0.0, 0.2]]), pushed, np.array([[0.1, 0.0, 1.0]]))
    return found | {
        "planner": float(costs[0]),
        "compiled": rollout("sarsa"),
        "catch": catch_limiter(hard).limit(8.0, 0.0, 0.0),
    }


if __name__ == "__main__":
    print(
        json.dumps({"package": kendama_cli.__file__, "rewards": rewards(), "tensions": tensions(), "limits": limits()})
    )
