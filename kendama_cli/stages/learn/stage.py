"""Learn: the swing-up is learned from nothing in simulation, and the frozen table is put to the test."""

from __future__ import annotations

import statistics
from collections.abc import Mapping
from typing import Any

import numpy as np

from kendama_cli.learning.policy import GreedyPolicy
from kendama_cli.learning.sarsa import SarsaLearner
from kendama_cli.learning.settings import LearnSettings
from kendama_cli.log.messages import RolloutMessage
from kendama_cli.schema.arrays import Array
from kendama_cli.schema.foxglove import FrameTransform
from kendama_cli.settings.game import GameSettings
from kendama_cli.simulation.swingup.bound import SwingBound, swing_bound
from kendama_cli.simulation.swingup.engine import SwingEngine
from kendama_cli.simulation.swingup.environment import SwingUpEnvironment
from kendama_cli.stages.interface import Made, Metric, StageContext
from kendama_cli.stages.learn.messages import QTableMessage, SwingStateMessage

LOG_PERIOD_S = 0.004
RECENT = 20
"""Rollouts over which the progress view gives the success rate."""


class Learn:
    """Needs nothing; gives the Policy of the swing-up."""

    def __init__(self, *, learn: LearnSettings, game: GameSettings) -> None:
        self._settings = learn
        self._game = game

    def prepare(self) -> None:
        """Search the bound, which is the same for every seed, and load the compiled code of the engine."""
        swing_bound(self._settings, self._game)
        environment = SwingUpEnvironment(self._settings, self._game)
        learner = SarsaLearner(self._settings)
        rng = np.random.default_rng(0)
        learner.begin_rollout(rng)
        environment.roll_out(learner, environment.noise(rng))
        environment.catch(0.0)

    def run(self, given: Mapping[str, Any], ctx: StageContext) -> Made:
        """Learn by the counting rule of kendama_cli/learning/statistics.py, then evaluate the frozen table.

        ``rollouts_to_learn`` follows that rule. Over the evaluation's noisy rollouts ``frozen_success_rate`` is the
        share that reaches the goal, ``frozen_caught_rate`` the share whose flight also ends within the cup's mouth;
        ``swings`` (half-swings up to the goal) and ``time_to_goal_s`` are medians over the successes, and
        ``peak_displacement_m`` is the largest of all. ``time_to_goal_bound_s`` and ``swings_bound`` are what optimal
        control needs without noise; ConfigError is raised where even that does not reach the goal. ``learned`` is
        false where the cap was reached; nothing is raised then.
        """
        bound = swing_bound(self._settings, self._game)
        environment = SwingUpEnvironment(self._settings, self._game)
        learner, tally = self._begin(ctx)
        self._train(environment, learner, tally, ctx)
        self._evaluate(environment, learner, tally, ctx)
        self._log_nominal(environment, learner, ctx)
        return Made(learner.policy, self._metrics(learner, tally, bound))

    def _begin(self, ctx: StageContext) -> tuple[SarsaLearner, dict[str, Any]]:
        saved = ctx.restore()
        if saved is not None:
            return SarsaLearner.from_state(self._settings, saved), dict(saved["tally"])
        tally = {"simulated_s": 0.0, "recent": [], "tried": 0, "goals": [], "caught": 0, "peak_m": 0.0}
        return SarsaLearner(self._settings), tally

    def _train(
        self, environment: SwingUpEnvironment, learner: SarsaLearner, tally: dict[str, Any], ctx: StageContext
    ) -> None:
        noise_rng, exploration_rng = ctx.rng("rollouts"), ctx.rng("exploration")
        while not learner.count.finished(self._settings.count):
            learner.begin_rollout(exploration_rng)
            validation = learner.count.frozen(self._settings.count)
            rollout = environment.roll_out(learner, environment.noise(noise_rng, validation=validation))
            finished = learner.end_rollout(rollout.outcome, rollout.final)
            tally["simulated_s"] += rollout.duration_s
            tally["recent"] = [*tally["recent"], finished.success][-RECENT:]
            message = RolloutMessage(
                index=finished.index,
                explored=finished.explored,
                reward=finished.reward,
                success=finished.success,
                duration_s=rollout.duration_s,
                peak_displacement_m=rollout.peak_displacement_m,
                half_swings=rollout.half_swings,
            )
            ctx.log.write("/learn/rollout", tally["simulated_s"], message)
            if finished.index & (finished.index - 1) == 0:  # 1, 2, 4, 8, ...
                _log_table(learner.q, finished.index, tally, ctx)
            ctx.checkpoint(lambda: {**learner.state(), "tally": tally})
            ctx.progress(
                finished.index,
                None,
                rollouts=finished.index,
                success_rate=sum(tally["recent"]) / len(tally["recent"]),
                greedy_streak=learner.count.streak,
            )
        if not tally["tried"]:
            _log_table(np.asarray(learner.policy.q), learner.rollouts, tally, ctx)

    def _evaluate(
        self, environment: SwingUpEnvironment, learner: SarsaLearner, tally: dict[str, Any], ctx: StageContext
    ) -> None:
        policy = GreedyPolicy(learner.policy, self._settings)
        noise_rng = ctx.rng("evaluation")
        mouth_m = self._game.cup.radius_m - self._game.ball.radius_m
        while tally["tried"] < self._settings.count.evaluation:
            policy.begin_rollout()
            rollout = environment.roll_out(policy, environment.noise(noise_rng))
            tally["tried"] += 1
            tally["peak_m"] = max(tally["peak_m"], rollout.peak_displacement_m)
            if rollout.outcome == "goal":
                tally["goals"] = [*tally["goals"], [rollout.half_swings, rollout.duration_s]]
                tally["caught"] += environment.catch(rollout.duration_s).miss_m < mouth_m
            ctx.checkpoint(lambda: {**learner.state(), "tally": tally})
            ctx.progress(
                tally["tried"],
                self._settings.count.evaluation,
                rollouts=learner.rollouts,
                frozen_success_rate=len(tally["goals"]) / tally["tried"],
            )

    def _log_nominal(self, environment: SwingUpEnvironment, learner: SarsaLearner, ctx: StageContext) -> None:
        """One rollout of the frozen table without noise, and on through free flight to the cup (PAPER.md Fig. 6)."""
        policy = GreedyPolicy(learner.policy, self._settings)
        every = max(1, round(LOG_PERIOD_S / self._settings.step_s))
        steps = 0

        def log_step(t_s: float, swing: SwingEngine, acceleration_m_s2: float) -> None:
            nonlocal steps
            if steps % every == 0:
                _log_step(ctx, t_s, environment, swing, acceleration_m_s2)
            steps += 1

        rollout = environment.roll_out(policy, environment.noiseless(), log_step)
        if rollout.outcome == "goal":
            environment.catch(rollout.duration_s, log_step)

    def _metrics(self, learner: SarsaLearner, tally: Mapping[str, Any], bound: SwingBound) -> dict[str, Metric]:
        goals = tally["goals"]
        return {
            "learned": learner.count.learned,
            "rollouts_to_learn": learner.count.rollouts_to_learn(self._settings.count),
            "rollouts": learner.rollouts,
            "frozen_success_rate": len(goals) / tally["tried"],
            "frozen_caught_rate": tally["caught"] / tally["tried"],
            "swings": statistics.median(half_swings for half_swings, _ in goals) if goals else None,
            "time_to_goal_s": statistics.median(duration_s for _, duration_s in goals) if goals else None,
            "time_to_goal_bound_s": bound.time_to_goal_s,
            "swings_bound": bound.half_swings,
            "peak_displacement_m": tally["peak_m"],
            "simulated_s": tally["simulated_s"],
        }


def _log_table(q: Array, rollout: int, tally: Mapping[str, Any], ctx: StageContext) -> None:
    rows, columns = q.shape
    message = QTableMessage(rollout=rollout, rows=rows, columns=columns, values=q.ravel().tolist())
    ctx.log.write("/learn/table", tally["simulated_s"], message)


def _log_step(
    ctx: StageContext, t_s: float, environment: SwingUpEnvironment, swing: SwingEngine, acceleration_m_s2: float
) -> None:
    state = environment.state()
    message = SwingStateMessage(**state._asdict(), action_m_s2=acceleration_m_s2, tension_n=swing.tension_n)
    ctx.log.write("/learn/step", t_s, message)
    for child, place in (
        ("cup", (swing.x_m, 0.0, 0.0)),
        ("ball", (swing.x_m + swing.across_m, 0.0, swing.above_m)),
    ):
        ctx.log.write(f"/learn/{child}", t_s, FrameTransform("world", child, place))
