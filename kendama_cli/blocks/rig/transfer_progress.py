"""How far a transfer has come, between two rollouts: all that a checkpoint needs to go on bit for bit."""

from __future__ import annotations

import zlib
from collections.abc import Mapping
from typing import Any

import numpy as np

from kendama_cli.artifacts.policy import Policy
from kendama_cli.learning.sarsa import SarsaLearner
from kendama_cli.settings.learn import LearnSettings


class Progress:
    """Results by step, the learner between two rollouts, the simulated clock of the log, and the seed of it all.

    Every rollout draws from a stream of its own (step, number), so that nothing depends on a rollout that broke off.
    """

    def __init__(self, state: Mapping[str, Any], settings: LearnSettings) -> None:
        self.before: list[bool] = list(state["before"])
        self.after: list[bool] = list(state["after"])
        self.imitation: list[bool] = list(state["imitation"])
        self.imitation_fit: dict[str, Any] = dict(state["imitation_fit"])
        self.games: list[dict[str, Any]] = [dict(game) for game in state["games"]]
        self.clock_s = float(state["clock_s"])
        self.missed = int(state["missed"])
        self._seed = int(state["seed"])
        self._settings = settings
        self._learner = {**state["learner"], "q": state["q"]}
        self._missed_here = 0

    @classmethod
    def resumed(
        cls, state: Mapping[str, Any] | None, policy: Policy, settings: LearnSettings, rng: np.random.Generator
    ) -> Progress:
        """Where ``state`` stands, or the beginning with ``policy``'s table."""
        if state is not None:
            return cls(state, settings)
        learner = SarsaLearner(settings, q=policy.q).state()
        table = learner.pop("q")
        empty: dict[str, Any] = {name: [] for name in ("before", "after", "imitation", "games")}
        fresh = {
            **empty,
            "imitation_fit": {},
            "clock_s": 0.0,
            "missed": 0,
            "seed": int(rng.integers(2**63)),
            "learner": learner,
            "q": table,
        }
        return cls(fresh, settings)

    def saved(self) -> dict[str, Any]:
        """The state to checkpoint: one array and JSON values."""
        learner = dict(self._learner)
        table = learner.pop("q")
        return {
            "before": list(self.before),
            "after": list(self.after),
            "imitation": list(self.imitation),
            "imitation_fit": dict(self.imitation_fit),
            "games": [dict(game) for game in self.games],
            "clock_s": self.clock_s,
            "missed": self.missed,
            "seed": self._seed,
            "learner": learner,
            "q": table,
        }

    def rng(self, step: str, number: int) -> np.random.Generator:
        """The random stream of one rollout."""
        return np.random.default_rng([self._seed, zlib.crc32(step.encode()), number])

    def learner(self) -> SarsaLearner:
        """A learner that goes on from the last finished rollout."""
        return SarsaLearner.from_state(self._settings, self._learner)

    def keep(self, learner: SarsaLearner) -> None:
        """The rollout is finished: this is what the next one goes on from."""
        self._learner = learner.state()

    @property
    def policy(self) -> Policy:
        """The table as it stands, sealed."""
        return self.learner().policy

    @property
    def learned_at(self) -> int | None:
        """The counting rule's number of rollouts, None before the row of greedy successes."""
        return self.learner().count.learned_at

    def learned(self, cap: int) -> bool:
        """Whether learning on the hardware is over."""
        count = self.learner().count
        return count.learned or count.rollouts >= cap

    def rollouts(self, cap: int) -> int:
        """Rollouts to learn on the hardware; the cap where that failed."""
        return cap if self.learned_at is None else self.learned_at

    @property
    def count(self) -> int:
        """All rollouts, plays and games so far."""
        frozen = len(self.before) + len(self.after) + len(self.imitation) + len(self.games)
        return frozen + self.learner().rollouts

    def finished(self, duration_s: float, missed: int) -> None:
        """One rollout more: the log's clock moves on; ``missed`` counts since this process opened the line."""
        self.clock_s += duration_s
        self.missed += missed - self._missed_here
        self._missed_here = missed
