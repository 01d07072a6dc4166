"""Learning in one environment of others: episodes that explore by harmonics or act by the table, and what came of it.

The law of learning is that of ``learn``: SARSA(lambda) with replacing traces, exploration for a whole episode, mutation
of the best harmonics, and the table of the best streak as the policy. An environment without success or failure has
instead the median return of the elite: a greedy episode below it has failed.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import gymnasium
import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from kendama_cli.errors import StageError
from kendama_cli.learning.decision import greedy_column
from kendama_cli.plugins.bench.artifact import TilePolicy
from kendama_cli.plugins.bench.settings import BenchSettings
from kendama_cli.plugins.bench.tiles import Levels, Numbers, TileTable, Tiling, bounds, flat, widened

_FASTEST = 4.0
"""Shortest period of a harmonic, in actions."""
WINDOW = 10
"""The table after the best mean of so many greedy episodes in a row is the policy."""
_SEEDS = 2**31 - 1


@dataclass(frozen=True)
class Harmonics:
    """amplitude cos(frequency k + phase) in each dimension, at action k of an episode; arrays (dimensions,)."""

    frequency: NDArray[np.float64]
    amplitude: NDArray[np.float64]
    phase: NDArray[np.float64]

    def at(self, k: int) -> NDArray[np.float64]:
        """Return the desired action, in fractions of its range."""
        return np.asarray(self.amplitude * np.cos(self.frequency * k + self.phase))

    @staticmethod
    def drawn(dimensions: int, longest: float, rng: Generator) -> Harmonics:
        """Sample periods from 4 actions to ``longest``, evenly on a logarithmic scale, and any phase."""
        slowest = math.log(max(longest, 2.0 * _FASTEST) / _FASTEST)
        period = _FASTEST * np.exp(slowest * rng.random(dimensions))
        amplitude, phase = 0.5 + rng.random(dimensions), 2.0 * math.pi * rng.random(dimensions)
        return Harmonics(2.0 * math.pi / period, amplitude, phase)

    def mutated(self, rng: Generator) -> Harmonics:
        """Return others near by: 5 % in frequency, 10 % in amplitude, 0.2 rad in phase (standard deviations)."""
        frequency, amplitude, phase = rng.standard_normal((3, len(self.phase)))
        return Harmonics(
            self.frequency * (1.0 + 0.05 * frequency),
            self.amplitude * (1.0 + 0.1 * amplitude),
            self.phase + 0.2 * phase,
        )


@dataclass(frozen=True)
class Episode:
    """One finished episode."""

    explored: bool
    total_reward: float
    steps: int


def _finite(what: str, values: Numbers, when: str) -> Numbers:
    if not np.isfinite(values).all():
        raise StageError(f"the environment's {what} is {values} {when}; a table learns of finite numbers alone")
    return values


class TabularLearner:
    """SARSA(lambda) on tiles in ``environment``; the random numbers are those of ``rng``."""

    def __init__(self, environment: gymnasium.Env[Any, Any], settings: BenchSettings, rng: Generator) -> None:
        """Find the ranges of the observations by exploring; raises ConfigError for spaces that have no tiles."""
        self._environment, self._settings, self._rng = environment, settings, rng
        spec = environment.spec
        limit = None if spec is None else spec.max_episode_steps
        self._limit = limit or settings.max_steps
        self._levels = Levels(environment.action_space, settings.action_levels)
        low, high = bounds(environment.observation_space)
        if np.isnan(low).any():
            low, high = widened(low, high, self._seen())
        self._tiling = Tiling(low, high, settings.tiles, settings.tilings)
        self._table = TileTable(
            self._levels.n, gamma=settings.gamma, trace_decay=settings.trace_decay, update=settings.learner
        )
        self._elite: list[tuple[float, Harmonics]] = []
        self.episodes = self.steps = 0
        self._failed, self._best = False, -np.inf
        self._greedy: list[float] = []
        self._kept = self._table.stored

    def _seen(self) -> Numbers:
        seen = []
        for _ in range(self._settings.ranging_episodes):
            harmonics = Harmonics.drawn(len(self._levels.shape), self._limit, self._rng)
            seen += self._played(lambda k, _, now=harmonics: self._levels.nearest(now.at(k)), self._seed())[1]
        return np.array(seen)

    def _seed(self) -> int:
        return int(self._rng.integers(_SEEDS))

    def _played(self, choose: Any, seed: int) -> tuple[float, list[Numbers]]:
        """Play an episode; return its reward and all observations (m, n)."""
        seen, total = [self._reset(seed)], 0.0
        for k in range(self._limit):
            action = self._levels.action(choose(k, seen[-1]))
            numbers, reward, _, ended = self._stepped(action)
            seen.append(numbers)
            total += reward
            if ended:
                break
        return total, seen

    def _reset(self, seed: int) -> Numbers:
        return _finite("observation", flat(self._environment.reset(seed=seed)[0]), "after a reset")

    def _stepped(self, action: Any) -> tuple[Numbers, float, bool, bool]:
        """Return observation and reward after ``action``, True at a true end, and True at any end."""
        observation, reward, terminated, truncated, _ = self._environment.step(action)
        after = f"after the action {action}"
        total = float(_finite("reward", np.array(float(reward)), after))
        return _finite("observation", flat(observation), after), total, terminated, terminated or truncated

    def episode(self) -> Episode:
        """Play one episode and learn from it."""
        own, rng = self._settings, self._rng
        explores = self.episodes < own.explore_first or (self._failed and rng.random() < own.after_failure)
        harmonics = self._harmonics() if explores and own.exploration == "harmonic" else None
        epsilon = own.epsilon / (1.0 + self.episodes / own.alpha_decay_episodes)
        alpha = own.alpha / (1.0 + self.episodes / own.alpha_decay_episodes)
        total, steps = self._learned(harmonics, epsilon if own.exploration == "epsilon_greedy" else 0.0, alpha)
        explored = harmonics is not None
        if harmonics is not None:
            self._elite = sorted([(total, harmonics), *self._elite], key=lambda one: -one[0])[: own.elite_size]
        else:
            self._count(total)
        self.episodes, self.steps = self.episodes + 1, self.steps + steps
        return Episode(explored, total, steps)

    def _count(self, total: float) -> None:
        self._failed = bool(self._elite) and total < float(np.median([one[0] for one in self._elite]))
        self._greedy = [*self._greedy, total][-WINDOW:]
        if len(self._greedy) == WINDOW and np.mean(self._greedy) > self._best:
            self._best, self._kept = float(np.mean(self._greedy)), self._table.stored

    def _harmonics(self) -> Harmonics:
        if self._elite and self._rng.random() < self._settings.mutation_fraction:
            return self._elite[int(self._rng.integers(len(self._elite)))][1].mutated(self._rng)
        return Harmonics.drawn(len(self._levels.shape), self._limit, self._rng)

    def _learned(self, harmonics: Harmonics | None, epsilon: float, alpha: float) -> tuple[float, int]:
        """Play and learn one episode; return its reward and number of actions."""
        table, rng, previous = self._table, self._rng, self._levels.n // 2

        def choice(k: int, values: Numbers) -> int:
            if harmonics is not None:
                return self._levels.nearest(harmonics.at(k))
            if epsilon and rng.random() < epsilon:
                return int(rng.integers(self._levels.n))
            return greedy_column(values.tolist(), previous)

        numbers = self._reset(self._seed())
        table.begin()
        rows = self._tiling.rows(numbers, grow=True)
        column, total = choice(0, table.values(rows)), 0.0
        for k in range(self._limit):
            previous = column
            numbers, reward, terminated, ended = self._stepped(self._levels.action(column))
            total += reward
            following_rows = self._tiling.rows(numbers, grow=True)
            values = table.values(following_rows)
            following = choice(k + 1, values)
            # where time ends it, the state there still has its value: only a true end has none
            table.update(rows, column, reward, None if terminated else (values, following), alpha)
            rows, column = following_rows, following
            if ended:
                break
        return total, k + 1

    def evaluated(self, episodes: int) -> dict[str, float]:
        """Return the mean returns of the frozen policy, of the best harmonic replayed, and of random actions; the gain.

        All three play the same episodes. Without a harmonic the second and the gain are NaN.
        """
        latest = self._table.stored
        self._table.restore(self._kept if np.isfinite(self._best) else latest)
        seeds = [self._seed() for _ in range(episodes)]
        held = [self._levels.n // 2]

        def greedy(k: int, numbers: Numbers) -> int:
            values = self._table.values(self._tiling.rows(numbers, grow=False)).tolist()
            held[0] = greedy_column(values, held[0] if k else self._levels.n // 2)
            return held[0]

        best = self._elite[0][1] if self._elite else None
        choices = {
            "frozen_return": greedy,
            "replayed_return": None if best is None else lambda k, _: self._levels.nearest(best.at(k)),
            "random_return": lambda k, _: int(self._rng.integers(self._levels.n)),
        }
        found = {
            name: float("nan") if choose is None else float(np.mean([self._played(choose, seed)[0] for seed in seeds]))
            for name, choose in choices.items()
        }
        return {**found, "gain": found["frozen_return"] - found["replayed_return"]}

    def policy(self) -> TilePolicy:
        """Return the frozen policy; after ``evaluated``."""
        own, tiling = self._settings, self._tiling
        keys = TilePolicy.as_keys(tiling.places)
        values = self._table.stored
        values = np.vstack([values, np.zeros((max(0, len(keys) - len(values)), self._levels.n))])[: len(keys)]
        numbers = own.tiles, own.tilings, own.action_levels
        return TilePolicy(own.environment, *numbers, tiling.low, tiling.high, keys, values)
