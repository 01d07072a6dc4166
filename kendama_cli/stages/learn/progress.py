"""Progress of the stage: the content of a checkpoint beside the learner, and the metrics computed from it."""

from __future__ import annotations

import dataclasses
import statistics
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from kendama_cli.artifacts.proportion import Evaluation
from kendama_cli.simulation.swingup.rollout import SimulatedRollout
from kendama_cli.stages.interface import Metric

RECENT = 20
"""Rollouts over which the progress view gives the success rate."""


@dataclass(frozen=True)
class Success:
    """A rollout of the evaluation that succeeded."""

    half_swings: int
    duration_s: float


@dataclass
class LearnProgress:
    """Rollouts of the learning and of the evaluation, as far as they have come."""

    simulated_s: float = 0.0
    recent: list[bool] = field(default_factory=list)
    """Success of the last rollouts of the learning."""
    evaluated: int = 0
    peak_m: float = 0.0
    """Largest |x| of the cup in the evaluation."""
    caught: int = 0
    """Rollouts of the evaluation after which the ball lay in the cup, which saw the true ball."""
    caught_by_sight: int = 0
    """Rollouts of the evaluation whose ball the cup catches by late, noisy measurements."""
    successes: list[Success] = field(default_factory=list)

    @classmethod
    def restored(cls, state: Mapping[str, Any]) -> LearnProgress:
        """Return the progress that ``saved`` stored in a checkpoint."""
        return cls(**{**state, "successes": [Success(**one) for one in state["successes"]]})

    def saved(self) -> dict[str, Any]:
        """Return the progress as JSON values."""
        return dataclasses.asdict(self)

    def learned_on(self, rollout: SimulatedRollout) -> None:
        """Count a rollout of the learning."""
        self.simulated_s += rollout.duration_s
        self.recent = [*self.recent, rollout.success][-RECENT:]

    def evaluated_on(self, rollout: SimulatedRollout, *, caught_by_sight: bool) -> None:
        """Count a rollout of the evaluation."""
        self.evaluated += 1
        self.caught_by_sight += caught_by_sight
        self.caught += rollout.caught
        self.peak_m = max(self.peak_m, rollout.peak_displacement_m)
        if rollout.success:
            self.successes.append(Success(rollout.half_swings, rollout.duration_s))

    @property
    def recent_success_rate(self) -> float:
        """Fraction of the last rollouts of the learning that succeeded."""
        return sum(self.recent) / len(self.recent)

    @property
    def frozen_success_rate(self) -> float:
        """Fraction of the evaluation that succeeded."""
        return len(self.successes) / self.evaluated

    def metrics(self, evaluation: Evaluation) -> dict[str, Metric]:
        """Return the metrics of the ``evaluation``, see Learn.run."""
        found = self.successes
        return {
            "frozen_rollouts": self.evaluated,
            **evaluation.figures("frozen_visual_caught_rate", self.caught_by_sight, self.evaluated),
            **evaluation.figures("frozen_caught_rate", self.caught, self.evaluated),
            "frozen_success_rate": self.frozen_success_rate,
            "half_swings": statistics.median(one.half_swings for one in found) if found else None,
            "time_to_goal_s": statistics.median(one.duration_s for one in found) if found else None,
            "peak_displacement_m": self.peak_m,
            "simulated_s": self.simulated_s,
        }
