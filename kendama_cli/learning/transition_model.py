"""What choices led to, by row and action: a model of the task, learned from the robot's own transitions."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from kendama_cli.learning.updates import Transition

ENDED = -1
"""The next row where the rollout ended."""


class TransitionModel:
    """The last ``outcomes`` transitions of every pair of row and action that was ever chosen.

    It is the sample model of Dyna (Sutton and Barto, 2nd edition, section 8.2) for a task that seems stochastic in
    bins: what it imagines is drawn from what really followed.
    """

    def __init__(self, rows: int, columns: int, outcomes: int) -> None:
        self._columns, self._outcomes = columns, outcomes
        self._led_to = np.full((rows * columns, outcomes, 2), ENDED)
        self._rewards = np.zeros((rows * columns, outcomes))
        self._seen = np.zeros(rows * columns, dtype=np.int64)
        self._pairs: list[int] = []

    def state(self) -> dict[str, NDArray[Any]]:
        """All there is to save: what the pairs that were chosen led to, in the order of their first choice."""
        pairs = np.array(self._pairs, dtype=np.int64)
        return {
            "model_pairs": pairs,
            "model_seen": self._seen[pairs],
            "model_led_to": self._led_to[pairs],
            "model_rewards": self._rewards[pairs],
        }

    def restore(self, state: dict[str, Any]) -> None:
        """Become what ``state()`` described."""
        pairs = np.asarray(state["model_pairs"], dtype=np.int64)
        self._pairs = pairs.tolist()
        for mine, name in ((self._seen, "seen"), (self._led_to, "led_to"), (self._rewards, "rewards")):
            mine[pairs] = state[f"model_{name}"]

    def add(self, transition: Transition) -> None:
        """Remember a transition; of a pair that was chosen more than ``outcomes`` times the oldest is forgotten."""
        pair = transition.row * self._columns + transition.column
        if not self._seen[pair]:
            self._pairs.append(pair)
        slot = self._seen[pair] % self._outcomes
        row, column = transition.next_row, transition.next_column
        self._led_to[pair, slot] = (ENDED, ENDED) if row is None else (row, column)
        self._rewards[pair, slot] = transition.reward
        self._seen[pair] += 1

    def imagined(self, n: int, rng: Generator) -> Iterator[Transition]:
        """``n`` transitions: of a pair that was chosen before, what followed it once."""
        pairs = np.array(self._pairs)[rng.integers(len(self._pairs), size=n)]
        slots = (rng.random(n) * np.minimum(self._seen[pairs], self._outcomes)).astype(np.int64)
        led_to, rewards = self._led_to[pairs, slots].tolist(), self._rewards[pairs, slots].tolist()
        for pair, (row, column), reward in zip(pairs.tolist(), led_to, rewards, strict=True):
            ended = row == ENDED
            begun, chosen = divmod(pair, self._columns)
            yield Transition(begun, chosen, reward, None if ended else row, None if ended else column)
