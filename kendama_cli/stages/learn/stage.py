"""Learn: the swing-up is learned from nothing in simulation, and the frozen policy is evaluated."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import Any

import numpy as np

from kendama_cli.learning.interface import Learner
from kendama_cli.learning.learners import begin_learner, joined_state, make_policy, parted_state, resume_learner
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
from kendama_cli.stages.learn.progress import LearnProgress

LOG_PERIOD_S = 0.004
LEARNER = "learner"
"""The learner's name in a checkpoint."""


class Learn:
    """Needs nothing; gives the PolicyArtifact of the swing-up."""

    def __init__(self, *, learn: LearnSettings, game: GameSettings) -> None:
        self._settings = learn
        self._game = game

    def prepare(self) -> None:
        """Search the bound, which is the same for every seed, and load the compiled code of the engine."""
        swing_bound(self._settings, self._game)
        environment, _ = self._environments()
        learner = begin_learner(self._settings)
        rng = np.random.default_rng(0)
        learner.begin_rollout(rng)
        environment.roll_out(learner, environment.noise(rng))
        environment.catch(0.0)

    def run(self, given: Mapping[str, Any], ctx: StageContext) -> Made:
        """Learn by the counting rule of kendama_cli/learning/statistics.py, then evaluate the frozen policy.

        ``rollouts_to_learn`` follows that rule. Over the evaluation's noisy rollouts ``frozen_success_rate`` is the
        share that reaches the goal, ``frozen_caught_rate`` the share whose flight also ends within the cup's mouth, and
        ``goal_slack_rate`` the share of the goals at which the rope is slack, as the goal's prediction of the flight
        assumes; ``swings`` (half-swings up to the goal) and ``time_to_goal_s`` are medians over the successes, and
        ``peak_displacement_m`` is the largest of all. ``time_to_goal_bound_s`` and ``swings_bound`` are what optimal
        control needs without noise; ConfigError is raised where even that does not reach the goal. ``learned`` is
        false where the cap was reached; nothing is raised then.
        """
        bound = swing_bound(self._settings, self._game)
        environment, validation = self._environments()
        learner, progress = self._begin(ctx)
        self._train(environment, validation, learner, progress, ctx)
        self._evaluate(environment, learner, progress, ctx)
        self._log_nominal(environment, learner, ctx)
        return Made(learner.policy, self._metrics(learner, progress, bound))

    def _environments(self) -> tuple[SwingUpEnvironment, SwingUpEnvironment]:
        """The environment that is learned in, and the one that validates: the same where nothing else is configured."""
        learning, engine = SwingUpEnvironment(self._settings, self._game), self._settings.validation.engine
        if engine is None or engine == self._settings.engine:
            return learning, learning
        return learning, SwingUpEnvironment(dataclasses.replace(self._settings, engine=engine), self._game)

    def _begin(self, ctx: StageContext) -> tuple[Learner, LearnProgress]:
        saved = ctx.restore()
        if saved is None:
            return begin_learner(self._settings), LearnProgress()
        return resume_learner(self._settings, joined_state(saved, LEARNER)), LearnProgress.restored(saved["progress"])

    def _checkpoint(self, learner: Learner, progress: LearnProgress, ctx: StageContext) -> None:
        ctx.checkpoint(lambda: {**parted_state(learner.state(), LEARNER), "progress": progress.saved()})

    def _train(
        self,
        environment: SwingUpEnvironment,
        validation: SwingUpEnvironment,
        learner: Learner,
        progress: LearnProgress,
        ctx: StageContext,
    ) -> None:
        noise_rng, exploration_rng = ctx.rng("rollouts"), ctx.rng("exploration")
        while not learner.count.finished(self._settings.count):
            learner.begin_rollout(exploration_rng)
            frozen = learner.count.frozen(self._settings.count)
            world = validation if frozen else environment
            rollout = world.roll_out(learner, world.noise(noise_rng, validation=frozen))
            finished = learner.end_rollout(rollout.outcome, rollout.final)
            progress.learned_on(rollout)
            message = RolloutMessage(
                index=finished.index,
                explored=finished.explored,
                reward=finished.reward,
                success=finished.success,
                duration_s=rollout.duration_s,
                peak_displacement_m=rollout.peak_displacement_m,
                half_swings=rollout.half_swings,
            )
            ctx.log.write("/learn/rollout", progress.simulated_s, message)
            if finished.index & (finished.index - 1) == 0:  # 1, 2, 4, 8, ...
                _log_table(learner.table, finished.index, progress, ctx)
            self._checkpoint(learner, progress, ctx)
            ctx.progress(
                finished.index,
                None,
                rollouts=finished.index,
                success_rate=progress.recent_success_rate,
                greedy_streak=learner.count.streak,
            )
        if not progress.evaluated:
            frozen_policy = make_policy(learner.policy, self._settings)
            _log_table(frozen_policy.table, learner.count.rollouts, progress, ctx)

    def _evaluate(
        self, environment: SwingUpEnvironment, learner: Learner, progress: LearnProgress, ctx: StageContext
    ) -> None:
        policy = make_policy(learner.policy, self._settings)
        noise_rng = ctx.rng("evaluation")
        mouth_m = self._game.cup.radius_m - self._game.ball.radius_m
        while progress.evaluated < self._settings.count.evaluation:
            policy.begin_rollout()
            rollout = environment.roll_out(policy, environment.noise(noise_rng))
            catch = environment.catch(rollout.duration_s) if rollout.outcome == "goal" else None
            progress.evaluated_on(rollout, catch, mouth_m)
            self._checkpoint(learner, progress, ctx)
            ctx.progress(
                progress.evaluated,
                self._settings.count.evaluation,
                rollouts=learner.count.rollouts,
                frozen_success_rate=progress.frozen_success_rate,
            )

    def _log_nominal(self, environment: SwingUpEnvironment, learner: Learner, ctx: StageContext) -> None:
        """One rollout of the frozen policy without noise, and on through free flight to the cup."""
        policy = make_policy(learner.policy, self._settings)
        policy.begin_rollout()
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

    def _metrics(self, learner: Learner, progress: LearnProgress, bound: SwingBound) -> dict[str, Metric]:
        return {
            "learned": learner.count.learned,
            "rollouts_to_learn": learner.count.rollouts_to_learn(self._settings.count),
            "rollouts": learner.count.rollouts,
            **progress.metrics(),
            "time_to_goal_bound_s": bound.time_to_goal_s,
            "swings_bound": bound.half_swings,
        }


def _log_table(table: Array | None, rollout: int, progress: LearnProgress, ctx: StageContext) -> None:
    """Log what the learner or policy keeps by state and action, where it keeps that."""
    if table is not None:
        rows, columns = table.shape
        message = QTableMessage(rollout=rollout, rows=rows, columns=columns, values=table.ravel().tolist())
        ctx.log.write("/learn/table", progress.simulated_s, message)


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
