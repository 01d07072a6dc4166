"""Offline: a policy is learned in one model alone, and then played on the world that was recorded."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from numpy.random import Generator

from kendama_cli.artifacts.policy import PolicyArtifact
from kendama_cli.artifacts.proportion import success_interval
from kendama_cli.learning.interface import Learner
from kendama_cli.learning.learners import begin_learner, make_policy
from kendama_cli.learning.settings import LearnSettings
from kendama_cli.plugins.offline.engine import environment_of
from kendama_cli.plugins.offline.messages import PolicySwingMessage
from kendama_cli.plugins.offline.recording import late
from kendama_cli.plugins.offline.settings import FitSettings, OfflineSettings
from kendama_cli.settings.game import GameSettings
from kendama_cli.simulation.swingup.engine import SwingEngine
from kendama_cli.simulation.swingup.environment import SwingUpEnvironment
from kendama_cli.simulation.swingup.frozen_rollouts import random_success_rate
from kendama_cli.simulation.swingup.rollout import RolloutNoise
from kendama_cli.stages.interface import Metric, StageContext, StageResult

LOG_PERIOD_S = 0.004


class Offline:
    """Needs the FittedModels; gives the PolicyArtifact that was learned in one of them."""

    def __init__(self, *, offline: OfflineSettings, fit: FitSettings, learn: LearnSettings, game: GameSettings) -> None:
        self._settings, self._fit, self._learn, self._game = offline, fit, learn, game

    def run(self, given: Mapping[str, Any], ctx: StageContext) -> StageResult:
        """Learn by the counting rule in the model, then play the frozen policy there and in the world.

        ConfigError is raised for a task that varies the rope where the model is the network.
        """
        name = self._settings.model
        model, world = (
            environment_of(one, given["fit"], self._fit, self._learn, self._game) for one in (name, "world")
        )
        learner = self._learned(name, model, ctx)
        policy, played = learner.policy, self._learn.count.evaluation_rollouts
        metrics: dict[str, Metric] = {
            "rollouts_to_solved": learner.count.rollouts_to_solved(self._learn.count),
            "solved": learner.count.solved,
        }
        for place, environment in (("model", model), ("world", world)):
            rng = ctx.rng(place)
            noises = (self._noise(name if place == "model" else "world", environment, rng) for _ in range(played))
            rolled = [environment.roll_out(self._actor(policy), noise).caught for noise in noises]
            between = success_interval(sum(rolled), played)
            rate = f"{place}_caught_rate"
            metrics |= {rate: sum(rolled) / played, f"{rate}_low": between.low, f"{rate}_high": between.high}
            self._log_nominal(environment, policy, ctx, world=environment is world)
        metrics["random_success_rate"] = random_success_rate(self._learn, world.game)
        return StageResult(policy, metrics)

    def _noise(self, name: str, environment: SwingUpEnvironment, rng: Generator) -> RolloutNoise:
        noise = environment.noise(rng)
        return late(noise, self._fit, self._learn) if name == "world" else noise

    def _learned(self, name: str, model: SwingUpEnvironment, ctx: StageContext) -> Learner:
        learner, noise_rng, exploration = begin_learner(self._learn), ctx.rng("rollouts"), ctx.rng("exploration")
        simulated_s = 0.0
        while not learner.count.finished(self._learn.count):
            learner.begin_rollout(exploration)
            rollout = model.roll_out(learner, self._noise(name, model, noise_rng))
            miss_m = None if rollout.catch is None else rollout.catch.miss_m
            finished = learner.end_rollout(rollout.outcome, rollout.final, miss_m)
            simulated_s += rollout.duration_s
            ctx.log.write("/offline/rollout", simulated_s, finished.message(rollout))
            ctx.progress(finished.index, None, greedy_streak=learner.count.streak)
        return learner

    def _actor(self, policy: PolicyArtifact) -> Any:
        actor = make_policy(policy, self._learn)
        actor.begin_rollout()
        return actor

    def _log_nominal(
        self, environment: SwingUpEnvironment, policy: PolicyArtifact, ctx: StageContext, *, world: bool
    ) -> None:
        every = max(1, round(LOG_PERIOD_S / self._learn.step_s))
        steps = 0

        def log_step(t_s: float, swing: SwingEngine, acceleration_m_s2: float) -> None:
            nonlocal steps
            if steps % every == 0:
                message = PolicySwingMessage(world, swing.x_m, swing.x_m + swing.across_m, swing.above_m)
                ctx.log.write("/offline/swing", t_s, message)
            steps += 1

        environment.roll_out(self._actor(policy), environment.noiseless(), log_step)
