"""SARSA(lambda) with linear function approximation: the value of an action is the sum over the active tiles.

    Q(s, a) = sum_k w[tile_k(s), a],    w += alpha / n [r + gamma V - Q(s, a)] e

for n tilings, with V of ``learn.update`` and replacing traces e on the weights (Sutton and Barto, 2nd edition, 12.7).
Actions change where the bins of ``learn.grid`` do, as a table's; the tiles say what the state is then.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from kendama_cli.artifacts.policy import PolicyArtifact
from kendama_cli.learning.decision import BinActor, HeldAction, greedy_column, seal_table, task_meaning
from kendama_cli.learning.interface import LearnerMaker
from kendama_cli.learning.settings import LearnSettings
from kendama_cli.learning.state import SwingState
from kendama_cli.learning.updates import Transition, ahead, keeps_traces
from kendama_cli.learning.value_learner import ValueLearner
from kendama_cli.plugins.learners.settings import TileCodingSettings


class Tiles:
    """Tiles of cup place, cup velocity, ball angle and rate; ``n`` in all tilings together.

    Tiling k of n is offset by the share (k (2 j + 1) mod n) / n of a tile along coordinate j: odd steps spread the
    tiles evenly (Miller and Glanz). Places follow ``learn.grid.position``: x, its distance from the middle, or left and
    right turned about where x < 0. The angle goes round; beyond the other ranges the outermost tiles go on.
    """

    def __init__(self, settings: LearnSettings) -> None:
        own = settings.learner
        assert isinstance(own, TileCodingSettings)
        workspace = settings.workspace
        self._mirrored = settings.grid.position == "mirrored"
        self._distance = settings.grid.position == "distance"
        one_sided = self._mirrored or self._distance
        counts = np.array([own.position_tiles, own.velocity_tiles, own.angle_tiles, own.rate_tiles])
        half = np.array([workspace.half_width_m, workspace.max_speed_m_s, math.pi, own.max_rate_rad_s])
        self._lowest = np.where([one_sided, False, False, False], 0.0, -half)
        self._per_unit = counts / (half - self._lowest)
        steps = np.arange(own.tilings)[:, None] * (2 * np.arange(4) + 1)
        self._offsets = (steps % own.tilings) / own.tilings
        self._last = counts  # an offset line takes one tile more than it is cut into
        self._angles = own.angle_tiles
        shape = np.where([True, True, False, True], counts + 1, counts)
        self._strides = np.array([math.prod(shape[j + 1 :].tolist()) for j in range(4)])
        one = math.prod(shape.tolist())
        self._first = np.arange(own.tilings) * one
        self.n = own.tilings * one

    def active(self, state: SwingState) -> NDArray[np.int64]:
        """Return the active tile of each tiling (tilings,)."""
        numbers = np.array(state)
        if self._mirrored and state.x_m < 0.0:
            numbers = -numbers
        if self._distance:
            numbers[0] = abs(numbers[0])
        places = np.floor((numbers - self._lowest) * self._per_unit + self._offsets).astype(np.int64)
        angles = places[:, 2] % self._angles
        places = np.clip(places, 0, self._last)
        places[:, 2] = angles
        return np.asarray(places @ self._strides + self._first)


class TileValues:
    """Weights (tiles, actions), and traces on those that the present rollout has used.

    A transition's row is the number of a visit of this rollout, which ``visit`` gives.
    """

    def __init__(self, weights: NDArray[np.float64], settings: LearnSettings) -> None:
        assert isinstance(settings.learner, TileCodingSettings)
        self.q = weights
        self._flat = self.q.reshape(-1)
        self._columns = weights.shape[1]
        self._tilings = settings.learner.tilings
        self._update = settings.update
        self._gamma, self._fading = settings.gamma, settings.gamma * settings.trace_decay
        self._visits: list[NDArray[np.int64]] = []
        self.begin()

    @property
    def tables(self) -> NDArray[np.float64]:
        """A copy of the weights."""
        return np.array(self.q)

    def begin(self) -> None:
        """Forget all traces."""
        self._places: dict[int, int] = {}
        self._marked, self._traces = np.empty(64, dtype=np.int64), np.empty(64)

    def forget_visits(self) -> None:
        """Forget the visits of the last rollout."""
        self._visits = []

    def visit(self, active: NDArray[np.int64]) -> int:
        """Return the row of a transition that begins where these tiles are active."""
        self._visits.append(active)
        return len(self._visits) - 1

    def values(self, q: NDArray[np.float64], row: int) -> list[float]:
        """Return the values of the actions at a visit, by the weights ``q``."""
        found: list[float] = q[self._visits[row]].sum(axis=0).tolist()
        return found

    def update(self, transition: Transition, alpha: float) -> float:
        """Learn from one transition; returns the temporal-difference error before the update."""
        step, used = alpha / self._tilings, self._visits[transition.row] * self._columns + transition.column
        following, kept = 0.0, True
        if transition.next_row is not None and transition.next_column is not None:
            there = np.array([self.values(self.q, transition.next_row)]), 0, transition.next_column
            following, kept = ahead(self._update, *there), keeps_traces(self._update, *there)
        error = transition.reward + self._gamma * following - float(self._flat[used].sum())
        n = len(self._places)
        self._traces[:n] *= self._fading
        for entry in used.tolist():
            place = self._places.setdefault(entry, n)
            if place == n:
                n = self._longer(entry)
            self._traces[place] = 1.0
        self._flat[self._marked[:n]] += step * error * self._traces[:n]
        if not kept:
            self.begin()
        return error

    def _longer(self, entry: int) -> int:
        """Add one more trace, of ``entry``; return how many there are."""
        n = len(self._places)
        if n > len(self._marked):
            self._marked, self._traces = np.resize(self._marked, 2 * n), np.resize(self._traces, 2 * n)
        self._marked[n - 1], self._traces[n - 1] = entry, 0.0
        return n


class TileCodingLearner(ValueLearner):
    """SARSA(lambda) on tiles; for the rest as a table's learner."""

    table = None
    _values: TileValues

    def _begin_values(self, q: NDArray[np.float64] | None) -> TileValues:
        settings = self._settings
        assert isinstance(settings.learner, TileCodingSettings)
        self._tiles = Tiles(settings)
        if q is not None:
            return TileValues(np.array(_checked(q, settings, self._tiles)), settings)
        shape = self._tiles.n, len(settings.actions_m_s2)
        return TileValues(np.full(shape, settings.initial_q / settings.learner.tilings), settings)

    def _sealed(self, q: NDArray[np.float64]) -> PolicyArtifact:
        return seal_table(q, self._settings, _meaning(self._settings))

    def begin_rollout(self, rng: Generator) -> None:
        """Decide whether this rollout explores, and forget the visits of the last one."""
        super().begin_rollout(rng)
        self._values.forget_visits()

    def _decide(self, held: HeldAction, row: int, state: SwingState, t_s: float) -> float:
        return super()._decide(held, self._values.visit(self._tiles.active(state)), state, t_s)


class TilePolicy(BinActor):
    """Policy of the action of the largest value, at the times at which a table would be asked."""

    table = None

    def __init__(self, policy: PolicyArtifact, settings: LearnSettings) -> None:
        """Raise ValueError if the weights have not the shape that the settings need."""
        super().__init__(settings)
        self._tiles = Tiles(settings)
        self._weights = _checked(policy.array("q"), settings, self._tiles)

    def begin_rollout(self) -> None:
        """Forget the last action; the next call of ``act`` chooses at once."""
        self._let_go()

    def _decide(self, held: HeldAction, row: int, state: SwingState, t_s: float) -> float:
        values: list[float] = self._weights[self._tiles.active(state)].sum(axis=0).tolist()
        column = greedy_column(values, held.mirrored(held.action))
        held.hold(row, held.mirrored(column), t_s)
        return self._settings.actions_m_s2[held.action]


def _checked(weights: NDArray[np.float64], settings: LearnSettings, tiles: Tiles) -> NDArray[np.float64]:
    wanted = tiles.n, len(settings.actions_m_s2)
    if weights.shape != wanted:
        raise ValueError(f"the weights have shape {weights.shape}; the configuration 'learn' needs {wanted}")
    return np.asarray(weights, dtype=np.float64)


def _begin(settings: LearnSettings, policy: PolicyArtifact | None) -> TileCodingLearner:
    return TileCodingLearner(settings, q=None if policy is None else policy.array("q"))


def _meaning(settings: LearnSettings) -> dict[str, object]:
    """Return the task and the tiling of its state."""
    tiles = {key: getattr(settings.learner, key) for key in TileCodingSettings.__dataclass_fields__ if key != "kind"}
    workspace = [settings.workspace.half_width_m, settings.workspace.max_speed_m_s]
    return {**task_meaning(settings), "tiles": tiles, "tiled_workspace": workspace}


TILE_CODING = LearnerMaker(begin=_begin, resume=TileCodingLearner.from_state, policy=TilePolicy, meaning=_meaning)
"""The kind ``tile_coding``."""
