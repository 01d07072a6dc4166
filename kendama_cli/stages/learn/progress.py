"""How far the stage has come: all that a checkpoint holds beside the learner, and the metrics made of it."""

from __future__ import annotations

import dataclasses
import statistics
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from kendama_cli.simulation.swingup.rollout import Catch, SimulatedRollout
from kendama_cli.stages.interface import Metric

RECENT = 20
"""Rollouts over which the progress view gives the success rate."""


@dataclass(frozen=True)
class ReachedGoal:
    """A rollout of the evaluation that reached the goal, and the flight after it."""

    half_swings: int
    duration_s: float
    slack: bool
    caught: bool


@dataclass
class LearnProgress:
    """Rollouts of the learning and of the evaluation, as far as they have come."""

    simulated_s: float = 0.0
    recent: list[bool] = field(default_factory=list)
    """Success of the last rollouts of the learning."""
    evaluated: int = 0
    peak_m: float = 0.0
    """Largest |x| of the cup in the evaluation."""
    goals: list[ReachedGoal] = field(default_factory=list)

    @classmethod
    def restored(cls, state: Mapping[str, Any]) -> LearnProgress:
        """What ``saved`` gave, after its way through a checkpoint."""
        return cls(**{**state, "goals": [ReachedGoal(**goal) for goal in state["goals"]]})

    def saved(self) -> dict[str, Any]:
        """JSON values."""
        return dataclasses.asdict(self)

    def learned_on(self, rollout: SimulatedRollout) -> None:
        """Count a rollout of the learning."""
        self.simulated_s += rollout.duration_s
        self.recent = [*self.recent, rollout.outcome == "goal"][-RECENT:]

    def evaluated_on(self, rollout: SimulatedRollout, catch: Catch | None, mouth_m: float) -> None:
        """Count a rollout of the evaluation and, where it reached the goal, the flight after it.

        ``mouth_m`` is how far from the cup's axis the ball's centre may come down.
        """
        self.evaluated += 1
        self.peak_m = max(self.peak_m, rollout.peak_displacement_m)
        if catch is not None:
            slack, caught = rollout.tension_n == 0.0, catch.miss_m < mouth_m
            self.goals.append(ReachedGoal(rollout.half_swings, rollout.duration_s, slack, caught))

    @property
    def recent_success_rate(self) -> float:
        """Share of the last rollouts of the learning that reached the goal."""
        return sum(self.recent) / len(self.recent)

    @property
    def frozen_success_rate(self) -> float:
        """Share of the evaluation that reached the goal."""
        return len(self.goals) / self.evaluated

    def metrics(self) -> dict[str, Metric]:
        """What the evaluation shows, see Learn.run."""
        goals = self.goals
        return {
            "frozen_success_rate": self.frozen_success_rate,
            "frozen_caught_rate": sum(goal.caught for goal in goals) / self.evaluated,
            "goal_slack_rate": sum(goal.slack for goal in goals) / len(goals) if goals else None,
            "swings": statistics.median(goal.half_swings for goal in goals) if goals else None,
            "time_to_goal_s": statistics.median(goal.duration_s for goal in goals) if goals else None,
            "peak_displacement_m": self.peak_m,
            "simulated_s": self.simulated_s,
        }
