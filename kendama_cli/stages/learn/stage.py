"""Learn: the swing-up is learned from nothing in simulation, and the frozen policy is evaluated."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import Any

import numpy as np

from kendama_cli.learning.interface import Learner
from kendama_cli.learning.learners import begin_learner, joined_state, make_policy, parted_state, resume_learner
from kendama_cli.learning.settings import LearnSettings
from kendama_cli.schema.arrays import Array
from kendama_cli.schema.foxglove import FrameTransform
from kendama_cli.settings.game import GameSettings
from kendama_cli.simulation.swingup.engine import SwingEngine
from kendama_cli.simulation.swingup.environment import SwingUpEnvironment
from kendama_cli.simulation.swingup.frozen_rollouts import FrozenRollouts, random_success_rate
from kendama_cli.simulation.swingup.visual_flight import caught_by_sight
from kendama_cli.stages.interface import Metric, StageContext, StageResult
from kendama_cli.stages.learn.messages import QTableMessage, SwingStateMessage
from kendama_cli.stages.learn.progress import LearnProgress

LOG_PERIOD_S = 0.004
SOLVED_BY_CHANCE = 0.05
"""Fraction of random harmonics above which a task counts as solved at random."""
LEARNER = "learner"
"""The learner's name in a checkpoint."""


class Learn:
    """Needs nothing; gives the PolicyArtifact of the swing-up."""

    def __init__(self, *, learn: LearnSettings, game: GameSettings) -> None:
        self._settings = learn
        self._game = game

    def prepare(self) -> None:
        """Find what is the same for every seed, and load the compiled code of the engine."""
        random_success_rate(self._settings, self._game)
        environment, _ = self._environments()
        learner = begin_learner(self._settings)
        if learner.decides_on_bins:  # others have no compiled code, and threads of their own would be forked
            rng = np.random.default_rng(0)
            learner.begin_rollout(rng)
            environment.roll_out(learner, environment.noise(rng))

    def run(self, given: Mapping[str, Any], ctx: StageContext) -> StageResult:
        """Learn by the counting rule of kendama_cli/learning/statistics.py, then evaluate the frozen policy.

        ``rollouts_to_learned`` and ``rollouts_to_solved`` follow that rule, ``learned`` and ``solved`` say whether
        either was reached before the cap, and ``rollouts`` counts all that the policy has had. Over the evaluation's
        noisy rollouts ``frozen_visual_caught_rate`` is the fraction whose ball the cup catches by measurements that are
        late and noisy, ``frozen_caught_rate`` that which it catches where it knows the true ball,
        ``frozen_success_rate`` the fraction of what the task calls a success; ``half_swings`` and ``time_to_goal_s``
        are medians over the successes, and ``peak_displacement_m`` is the maximum of all. ``random_success_rate`` is
        the fraction of random harmonics that succeed. If unsolved nothing is raised.
        """
        chance = random_success_rate(self._settings, self._game)
        environment, validation = self._environments()
        learner, progress = self._begin(ctx)
        with FrozenRollouts(validation) as frozen:
            self._train(environment, frozen, learner, progress, ctx)
            if validation is environment:
                self._evaluate(frozen, learner, progress, ctx)
        if validation is not environment:
            with FrozenRollouts(environment) as frozen:
                self._evaluate(frozen, learner, progress, ctx)
        self._log_nominal(environment, learner, ctx)
        metrics = {**self._metrics(learner, progress), "random_success_rate": chance}
        return StageResult(learner.policy, metrics, _warnings(self._settings, chance, solved=learner.count.solved))

    def _environments(self) -> tuple[SwingUpEnvironment, SwingUpEnvironment]:
        """Return the environments for learning and for validation: the same one if nothing else is configured."""
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
        frozen: FrozenRollouts,
        learner: Learner,
        progress: LearnProgress,
        ctx: StageContext,
    ) -> None:
        noise_rng, exploration_rng = ctx.rng("rollouts"), ctx.rng("exploration")
        while not learner.count.finished(self._settings.count):
            if learner.count.frozen(self._settings.count):
                to_solve = learner.count.to_solve(self._settings.count)
                rollout = frozen.validate(learner, exploration_rng, noise_rng, at_most=to_solve)
            else:
                learner.begin_rollout(exploration_rng)
                rollout = environment.roll_out(learner, environment.noise(noise_rng))
            miss_m = None if rollout.catch is None else rollout.catch.miss_m
            finished = learner.end_rollout(rollout.outcome, rollout.final, miss_m)
            progress.learned_on(rollout)
            ctx.log.write("/learn/rollout", progress.simulated_s, finished.message(rollout))
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

    def _evaluate(self, frozen: FrozenRollouts, learner: Learner, progress: LearnProgress, ctx: StageContext) -> None:
        policy, noise_rng, evaluation = learner.policy, ctx.rng("evaluation"), self._settings.count.evaluation
        while to_look := evaluation.to_play(progress.caught_by_sight, progress.evaluated):
            rollout = frozen.evaluate(policy, noise_rng, at_most=to_look)
            seen = rollout.catch is not None and caught_by_sight(
                rollout.final, self._settings, self._game, ctx.rng("sight")
            )
            progress.evaluated_on(rollout, caught_by_sight=seen)
            self._checkpoint(learner, progress, ctx)
            ctx.progress(
                progress.evaluated,
                evaluation.planned,
                rollouts=learner.count.rollouts,
                frozen_success_rate=progress.frozen_success_rate,
            )

    def _log_nominal(self, environment: SwingUpEnvironment, learner: Learner, ctx: StageContext) -> None:
        """Log one rollout of the frozen policy without noise, through the flight to the cup."""
        policy = make_policy(learner.policy, self._settings)
        policy.begin_rollout()
        every = max(1, round(LOG_PERIOD_S / self._settings.step_s))
        steps = 0

        def log_step(t_s: float, swing: SwingEngine, acceleration_m_s2: float) -> None:
            nonlocal steps
            if steps % every == 0:
                _log_step(ctx, t_s, environment, swing, acceleration_m_s2)
            steps += 1

        environment.roll_out(policy, environment.noiseless(), log_step)

    def _metrics(self, learner: Learner, progress: LearnProgress) -> dict[str, Metric]:
        count = learner.count
        return {
            "learned": count.learned,
            "rollouts_to_learned": count.rollouts_to_learned(self._settings.count),
            "solved": count.solved,
            "rollouts_to_solved": count.rollouts_to_solved(self._settings.count),
            "rollouts": count.rollouts,
            **progress.metrics(self._settings.count.evaluation),
        }


def _warnings(settings: LearnSettings, chance: float, *, solved: bool) -> tuple[str, ...]:
    """Return the warnings that a reader of the figures must know first."""
    told = []
    if chance > SOLVED_BY_CHANCE:
        told.append(
            f"random harmonics solve the task '{settings.task}': {100 * chance:.0f} % of them succeed (more than "
            f"{100 * SOLVED_BY_CHANCE:g} %), so few rollouts say little about the learner; learn/task=hard is not "
            "solved at random"
        )
    if not solved:
        count = settings.count
        told.append(
            f"the swing-up is unsolved: no {count.solved_streak} successes in a row within {count.max_rollouts} "
            "rollouts; the result is the policy with the longest streak"
        )
    return tuple(told)


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
    for child, position in (
        ("cup", (swing.x_m, 0.0, 0.0)),
        ("ball", (swing.x_m + swing.across_m, 0.0, swing.above_m)),
    ):
        ctx.log.write(f"/learn/{child}", t_s, FrameTransform("world", child, position))
