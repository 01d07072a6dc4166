"""Speed of the swing-up's engines, and of MuJoCo beside them where it is installed (``pip install 'mujoco<4'``).

``python -m tests.benchmarks.swing`` prints name, value, unit and ratio; all of it in one process on one thread, warmed
up, the best of three. Ratios hold from machine to machine, absolute speeds do not.
"""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np

from kendama_cli.learning.decision import GreedyPolicy
from kendama_cli.learning.sarsa import SarsaLearner
from kendama_cli.learning.state import SwingState
from kendama_cli.simulation.swingup import rail_kernel as kernel
from kendama_cli.simulation.swingup.engine import SwingEngine
from kendama_cli.simulation.swingup.environment import SwingUpEnvironment
from kendama_cli.simulation.swingup.rail import CompiledRail, physics
from tests.benchmarks.ball_in_cup import BALL_IN_CUP
from tests.learning.settings_files import game_settings, learn_settings
from tests.simulation.swingup.rail_dart import DartRail

GAME = game_settings()
STEP_S = 0.002
SEED = 10000


def best_rate(work: Callable[[], int], repeats: int = 3) -> float:
    """Steps per second of processor time in the fastest of ``repeats``, after one that does not count."""
    work()
    rates = []
    for _ in range(repeats):
        began = time.process_time()
        steps = work()
        rates.append(steps / (time.process_time() - began))
    return max(rates)


def learning(swing: SwingEngine | None) -> Callable[[], int]:
    """One seed of `limit` learned and evaluated; the steps simulated."""

    def work() -> int:
        chosen = learn_settings()
        environment, learner = SwingUpEnvironment(chosen, GAME, swing), SarsaLearner(chosen)
        noise_rng, exploration_rng = np.random.default_rng([SEED, 1]), np.random.default_rng([SEED, 2])
        simulated_s = 0.0
        while not learner.count.finished(chosen.count):
            learner.begin_rollout(exploration_rng)
            rollout = environment.roll_out(learner, environment.noise(noise_rng))
            learner.end_rollout(rollout.outcome, rollout.final)
            simulated_s += rollout.duration_s
        policy = GreedyPolicy(learner.policy, chosen)
        for _ in range(chosen.count.evaluation_rollouts):
            policy.begin_rollout()
            rollout = environment.roll_out(policy, environment.noise(noise_rng))
            simulated_s += rollout.duration_s
        return round(simulated_s / STEP_S)

    return work


def gymnasium_steps(n: int, actions: int) -> int:
    """Random actions in ``n`` environments of Gymnasium at once, each held for 25 steps; one is a loop in Python."""
    from kendama_cli.gym import SwingUp, SwingUpVector  # noqa: PLC0415 - an extra

    chosen = np.random.default_rng(0).integers(0, 5, (actions, n))
    if n > 1:
        many = SwingUpVector(n, hold_s=0.05)
        many.reset(seed=SEED)
        for action in chosen:
            many.step(action)
    else:
        one = SwingUp(["simulation/engine=rail"], hold_s=0.05)
        one.reset(seed=SEED)
        for action in chosen[:, 0]:
            if any(one.step(action)[2:4]):
                one.reset()
    return chosen.size * 25


def kernel_steps(n: int, held: int) -> int:
    """Many swings under random accelerations, nothing kept but their ends."""
    swing = CompiledRail(GAME, STEP_S)
    swing.start(SwingState(0.0, 0.0, 1.0, 0.0))
    swings = np.tile(swing.numbers[:, None], (1, n))
    pushes = np.random.default_rng(0).choice([-8.0, -4.0, 4.0, 8.0], (held // 4, n))
    commands = np.concatenate([pushes, -pushes, -pushes, pushes])
    kernel.play(swings, commands, 50, physics(GAME, STEP_S))
    return commands.size * 50


def mujoco_python_loop(steps: int) -> int:
    """dm_control's ball_in_cup, stepped from Python, with a random control every ten steps."""
    import mujoco  # noqa: PLC0415 - optional

    model = mujoco.MjModel.from_xml_string(BALL_IN_CUP)
    data = mujoco.MjData(model)
    controls = np.random.default_rng(0).uniform(-1.0, 1.0, (steps // 10, 2))
    for control in controls:
        data.ctrl[:] = control
        for _ in range(10):
            mujoco.mj_step(model, data)
    return steps


def mujoco_rollouts(n: int, steps: int) -> int:
    """The same physics by MuJoCo's own compiled ``rollout``, one thread."""
    import mujoco  # noqa: PLC0415
    from mujoco import rollout  # noqa: PLC0415

    model = mujoco.MjModel.from_xml_string(BALL_IN_CUP)
    data = mujoco.MjData(model)
    start = np.zeros(mujoco.mj_stateSize(model, mujoco.mjtState.mjSTATE_FULLPHYSICS))
    mujoco.mj_getState(model, data, start, mujoco.mjtState.mjSTATE_FULLPHYSICS)
    controls = np.random.default_rng(0).uniform(-1.0, 1.0, (n, steps, 2))
    rollout.rollout(model, data, np.tile(start, (n, 1)), controls)
    return n * steps


def main() -> None:
    """Print the table."""
    rates = {
        "learning loop, rail in DART": best_rate(learning(DartRail(GAME, STEP_S))),
        "learning loop, rail": best_rate(learning(None)),
        "Gymnasium, one, a Python loop": best_rate(lambda: gymnasium_steps(1, 800)),
        "Gymnasium, 1024 at once": best_rate(lambda: gymnasium_steps(1024, 100)),
        "rail, one swing": best_rate(lambda: kernel_steps(1, 4000)),
        "rail, 64 swings": best_rate(lambda: kernel_steps(64, 800)),
    }
    try:
        rates["MuJoCo ball_in_cup, Python loop"] = best_rate(lambda: mujoco_python_loop(100_000))
        rates["MuJoCo ball_in_cup, rollout"] = best_rate(lambda: mujoco_rollouts(100, 1000))
    except ImportError:
        print("mujoco is not installed: no peers")
    peers = {
        "Gymnasium, 1024 at once": "Gymnasium, one, a Python loop",
        "learning loop, rail in DART": "MuJoCo ball_in_cup, Python loop",
        "rail, 64 swings": "MuJoCo ball_in_cup, rollout",
    }
    for name, rate in rates.items():
        peer = peers.get(name, "")
        ratio = f"{rate / rates[peer]:8.2f} x {peer}" if peer in rates else ""
        print(f"{name:34s} {rate:14,.0f} steps/s {ratio}")


if __name__ == "__main__":
    main()
