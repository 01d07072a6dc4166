"""Textbook problems with known answers (Sutton and Barto, Reinforcement Learning, 2nd edition)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from kendama_cli.learning.exploration import EpsilonGreedy
from kendama_cli.learning.sarsa import ValueTable
from kendama_cli.learning.state import SwingState
from kendama_cli.learning.updates import Transition

MOVES = ((-1, 0), (1, 0), (0, -1), (0, 1))
"""Up, down, left, right in a grid of (row, column)."""
NOWHERE = SwingState(0.0, 0.0, 0.0, 0.0)


@dataclass(frozen=True)
class Walk:
    """Example 6.2 and 7.1: a walk on a line from the middle to either end; the left pays ``left``, the right 1."""

    n: int = 5
    left: float = 0.0

    @property
    def values(self) -> np.ndarray:
        """Exact value of each place."""
        return self.left + (1.0 - self.left) * np.arange(1, self.n + 1) / (self.n + 1)

    def episode(self, rng: np.random.Generator) -> list[Transition]:
        """One random walk."""
        position, steps = self.n // 2, []
        while 0 <= position < self.n:
            after = position + (1 if rng.random() < 0.5 else -1)
            inside = 0 <= after < self.n
            reward = 1.0 if after == self.n else self.left if after < 0 else 0.0
            steps.append(Transition(position, 0, reward, after if inside else None, 0 if inside else None))
            position = after
        return steps

    def learned(
        self, table: ValueTable, rng: np.random.Generator, *, episodes: int, alpha: float, decay: float = np.inf
    ) -> list[float]:
        """Root mean square error over the places after each episode."""
        errors = []
        for episode in range(episodes):
            table.begin()
            for step in self.episode(rng):
                table.update(step, alpha / (1.0 + episode / decay))
            errors.append(float(np.sqrt(np.mean((table.q[:, 0] - self.values) ** 2))))
        return errors


class Grid(Protocol):
    """A gridworld with the four moves."""

    columns: int
    rows: int
    start: tuple[int, int]
    goal: tuple[int, int]

    def move(self, place: tuple[int, int], action: int) -> tuple[tuple[int, int], float]:
        """The next place and the reward."""


class WindyGrid:
    """Example 6.5: 7 x 10 cells, wind blows upward in some columns, every step costs 1; the shortest way has 15."""

    rows, columns, start, goal = 7, 10, (3, 0), (3, 7)
    wind = (0, 0, 0, 1, 1, 1, 2, 2, 1, 0)

    def move(self, place: tuple[int, int], action: int) -> tuple[tuple[int, int], float]:
        """The next place and the reward."""
        (row, column), (down, right) = place, MOVES[action]
        after = min(6, max(0, row + down - self.wind[column])), min(9, max(0, column + right))
        return after, -1.0


class Cliff:
    """Example 6.6: 4 x 12 cells, between start and goal a cliff that costs 100 and leads back to the start."""

    rows, columns, start, goal = 4, 12, (3, 0), (3, 11)

    def move(self, place: tuple[int, int], action: int) -> tuple[tuple[int, int], float]:
        """The next place and the reward."""
        (row, column), (down, right) = place, MOVES[action]
        after = min(3, max(0, row + down)), min(11, max(0, column + right))
        if after[0] == 3 and 0 < after[1] < 11:
            return self.start, -100.0
        return after, -1.0


class Behaviour(EpsilonGreedy):
    """The swing-up's own epsilon-greedy explorer, for any number of actions."""

    def __init__(self, epsilon: float, n: int, rng: np.random.Generator) -> None:
        self._epsilon, self._n, self._rng = epsilon, n, rng


def grid_episode(
    grid: Grid, table: ValueTable, rng: np.random.Generator, *, epsilon: float, alpha: float, longest: int = 5000
) -> tuple[float, int]:
    """Return and length of one epsilon-greedy episode, learned from on the way."""
    behaviour = Behaviour(epsilon, len(MOVES), rng)
    table.begin()

    def choose(place: tuple[int, int]) -> tuple[int, int]:
        row = place[0] * grid.columns + place[1]
        values = table.values(table.q, row)
        greedy = int(rng.choice(np.flatnonzero(np.array(values) == max(values))))
        return row, behaviour.action(0.0, NOWHERE, greedy)

    place, total, steps = grid.start, 0.0, 0
    row, action = choose(place)
    while steps < longest:
        place, reward = grid.move(place, action)
        total, steps = total + reward, steps + 1
        if place == grid.goal:
            table.update(Transition(row, action, reward, None, None), alpha)
            break
        next_row, next_action = choose(place)
        table.update(Transition(row, action, reward, next_row, next_action), alpha)
        row, action = next_row, next_action
    return total, steps


def greedy_path(grid: Grid, table: ValueTable, longest: int = 100) -> list[tuple[int, int]]:
    """The places of the greedy policy from start to goal."""
    position, path = grid.start, [grid.start]
    while position != grid.goal and len(path) <= longest:
        position, _ = grid.move(
            position, int(np.argmax(table.values(table.q, position[0] * grid.columns + position[1])))
        )
        path.append(position)
    return path
