"""What is acted by while values are learned, and what of it is handed over."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from kendama_cli.learning.statistics import LearningCount


class Acting:
    """The values to act by: the latest, or the mean of those after each success in a row so far.

    A large learning rate makes each table differ from the last, and the mean of several is nearer to what they vary
    about (iterate averaging: Polyak and Juditsky 1992, https://doi.org/10.1137/0330046). A failure, which is there to
    be learned from, ends the mean. The longest streak's values are kept, since those that came after may be worse.
    """

    def __init__(self, q: NDArray[np.float64], *, averaged: bool) -> None:
        self._mean = np.array(q) if averaged else None
        self._best, self._best_streak = np.array(q), 0

    def by(self, q: NDArray[np.float64]) -> NDArray[np.float64]:
        """What to act by where ``q`` are the latest values. Not to be written to."""
        return q if self._mean is None else self._mean

    def handed_over(self, q: NDArray[np.float64], count: LearningCount) -> NDArray[np.float64]:
        """The present values, unless earlier ones had the longer streak of greedy successes while they were frozen."""
        return self._best if self._best_streak > count.streak else self.by(q)

    def ended(
        self, q: NDArray[np.float64], before: LearningCount, after: LearningCount, *, learned: bool, streak: int
    ) -> None:
        """Take note of a rollout that made ``after`` of ``before``; ``streak`` successes in a row freeze the values."""
        if after.greedy_failed and before.streak >= max(streak, self._best_streak + 1):
            # what is frozen is still what made the streak that ends here
            self._best, self._best_streak = np.array(self.by(q)), before.streak
        if self._mean is not None and learned:
            self._mean += (q - self._mean) / max(1, after.streak)

    def state(self) -> dict[str, Any]:
        """All there is to save, between two rollouts."""
        mean = {} if self._mean is None else {"mean": np.array(self._mean)}
        return {"best": np.array(self._best), "best_streak": self._best_streak, **mean}

    def restore(self, state: Mapping[str, Any]) -> None:
        """Become what ``state()`` described."""
        self._best, self._best_streak = np.asarray(state["best"]), int(state["best_streak"])
        if self._mean is not None:
            self._mean = np.array(state["mean"])
