"""Bench: a learner of ours learns in an environment of others, and its policy is compared with its exploration."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import gymnasium

from kendama_cli.errors import StageError
from kendama_cli.plugins.bench import ball_in_cup
from kendama_cli.plugins.bench.learner import TabularLearner
from kendama_cli.plugins.bench.messages import EpisodeMessage
from kendama_cli.plugins.bench.settings import BenchSettings
from kendama_cli.stages.interface import StageContext, StageResult


class Bench:
    """Needs nothing; gives the TilePolicy of an environment."""

    def __init__(self, *, bench: BenchSettings) -> None:
        self._settings = bench

    def run(self, given: Mapping[str, Any], ctx: StageContext) -> StageResult:
        """Learn for ``episodes``, then evaluate the frozen policy and its baselines in the same episodes.

        StageError is raised where the environment cannot be made.
        """
        own = self._settings
        environment = _made(own.environment)
        learner = TabularLearner(environment, own, ctx.rng("episodes"))
        for index in range(1, own.episodes + 1):
            done = learner.episode()
            message = EpisodeMessage(index, done.explored, done.total_reward, done.steps)
            ctx.log.write("/bench/episode", float(learner.steps), message)
            ctx.progress(index, own.episodes, total_reward=done.total_reward)
        found = learner.evaluated(own.evaluation_episodes)
        environment.close()
        policy = learner.policy()
        counts = {"episodes": learner.episodes, "steps": learner.steps, "tiles": len(policy.keys)}
        return StageResult(policy, {**found, **counts})


def _made(name: str) -> gymnasium.Env[Any, Any]:
    ball_in_cup.register()
    try:
        return gymnasium.make(name)
    except Exception as error:  # an environment of others may fail in any way
        told = " ".join(f"{type(error).__name__}: {error}".split())
        raise StageError(
            f"environment '{name}' cannot be made ({told}); 'python -c \"import gymnasium; "
            "gymnasium.pprint_registry()\"' lists those there are"
        ) from None
