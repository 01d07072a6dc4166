"""Search for the soonest success of the nominal swing, in time and half-swings: a yardstick, not a bound.

Time-optimal control of a bounded acceleration is bang-bang but for arcs on the bounds (Pontryagin et al. 1962), which
here the workspace's limiter makes. So the search only ever tries the two extreme actions. It spreads in layers of
0.024 s from the hanging swing; of all states in a small cell of (x, v, angle, direction of swing, half-swings) the
one with the most energy goes on. The times of the soonest swing's switches are then moved, one and two at a time, by
whole time steps until no move makes it sooner. Dynamics, limits and goal are those of the learning environment,
without its noise. Nothing proves that there is no sooner swing: the cells that it prunes may hold one.
"""

from __future__ import annotations

import functools
import itertools
import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from kendama_cli.errors import ConfigError
from kendama_cli.learning.settings import LearnSettings
from kendama_cli.learning.state import SwingState
from kendama_cli.settings.game import GameSettings
from kendama_cli.simulation.swingup import rail_kernel as kernel
from kendama_cli.simulation.swingup.rail import CompiledRail, Rules

LAYER_S = 0.024
CELL = np.array([0.048, 0.24, 0.18])
"""Size of a cell along x [m], v [m/s] and angle [rad].

Coarser ones find swings on `hard` that are later than learned ones (3.26 s; these 2.92 s), finer ones take a learn
stage longer than its learning (two thirds of these: 2.66 s of the swing).
"""
FINER = 0.6
"""Factor on cells and layers where nothing was found: before the goal is called out of reach."""
MOVES = (-8, -4, -2, -1, 1, 2, 4, 8)
"""Steps by which switches are moved."""
FEW = 5
"""Up to so many switches any two are moved at once, otherwise only neighbours."""
Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


@dataclass(frozen=True)
class BestSwing:
    """The shortest time to the goal and the fewest half-swings found, which need not be of the same swing.

    ``switches_s`` are the times at which the soonest swing's action changes, from ``first_m_s2`` to the other extreme
    and back.
    """

    time_to_goal_s: float
    half_swings: int
    first_m_s2: float
    switches_s: tuple[float, ...]


@functools.lru_cache(maxsize=16)
def best_swing(settings: LearnSettings, game: GameSettings) -> BestSwing:
    """Search the best swing for the limits, goal and longest duration in ``settings``.

    Raises ConfigError where no swing within ``learn.rollout_s`` reaches the goal.
    """
    search = _Search(settings, game)
    found = search.spread(1.0) or search.spread(FINER)
    if found is None:
        raise ConfigError(
            "learn.goal",
            f"'learn.goal' is out of reach: no swing of up to {settings.rollout_s:g} s with accelerations of "
            f"{settings.actions_m_s2[0]:g} to {settings.actions_m_s2[-1]:g} m/s^2 within "
            f"{settings.workspace.half_width_m:g} m comes to it; widen learn.goal, or allow more by "
            "learn.actions_m_s2, learn.workspace or learn.rollout_s",
        )
    return search.refined(*found)


class _Search:
    def __init__(self, settings: LearnSettings, game: GameSettings) -> None:
        self._step_s = settings.step_s
        self._n_steps = max(1, round(settings.rollout_s / settings.step_s))
        self._extremes = np.array([settings.actions_m_s2[0], settings.actions_m_s2[-1]], dtype=np.float64)
        rules = Rules.of(settings, game)
        self._physics, self._aim, self._catch, limits = rules.physics, rules.aim, rules.catch, rules.limits
        if math.isinf(limits.half_width_m):  # the edge ends a rollout: braking just in time never loses to leaving
            weaker = min(-settings.actions_m_s2[0], settings.actions_m_s2[-1])
            limits = limits._replace(half_width_m=limits.edge_m, braking_m_s2=weaker, max_m_s2=weaker)
        self._limits = limits
        swing = CompiledRail(game, settings.step_s)
        swing.start(SwingState(0.0, 0.0, 0.0, 0.0))
        self._start = swing.numbers
        self._gravity = game.gravity_m_s2

    def spread(self, fineness: float) -> tuple[Ints, int] | None:
        """Return the soonest swing's extreme action in each step, and the fewest half-swings; None without a swing."""
        steps = max(1, round(fineness * LAYER_S / self._step_s))
        swings, tallies = self._start[None].copy(), np.zeros((1, kernel.TALLY))
        history: list[tuple[Ints, Ints]] = []
        best: Ints | None = None
        fewest = np.inf
        for layer in range(math.ceil(self._n_steps / steps)):
            parents, chosen = np.repeat(np.arange(len(swings)), 2), np.tile([0, 1], len(swings))
            swings, tallies = swings[parents], tallies[parents]
            held = np.full(len(swings), min(steps, self._n_steps - layer * steps))
            ends, taken = self._hold(swings, tallies, self._extremes[chosen], held)
            goals = np.flatnonzero(ends == kernel.GOAL)
            if len(goals):
                if best is None:
                    soonest = goals[np.argmin(taken[goals])]
                    path = [int(chosen[soonest])]
                    node = int(parents[soonest])
                    for before, choice in reversed(history):
                        path.append(int(choice[node]))
                        node = int(before[node])
                    best = np.repeat(path[::-1], steps)[: layer * steps + int(taken[soonest])]
                fewest = min(fewest, tallies[goals, kernel.HALF_SWINGS].min())
            keep = np.flatnonzero((ends == kernel.DUE) & (tallies[:, kernel.HALF_SWINGS] < fewest))
            keep = keep[self._one_of_each_cell(swings[keep], tallies[keep], fineness)]
            history.append((parents[keep], chosen[keep]))
            swings, tallies = swings[keep], tallies[keep]
            if not len(keep):
                break
        return None if best is None else (best, int(fewest))

    def refined(self, commanded: Ints, fewest: int) -> BestSwing:
        """Move the switches of the swing ``commanded`` to where it reaches the goal soonest."""
        switches, first = np.flatnonzero(np.diff(commanded)) + 1, int(commanded[0])
        steps = len(commanded)
        while True:
            moved = self._moved(switches, steps)
            times = self._steps_to_goal(moved, first, steps)
            if not len(times) or times.min() >= steps:
                break
            switches, steps = moved[np.argmin(times)], int(times.min())
            switches = _without_empty(switches[switches < steps])
        return BestSwing(
            time_to_goal_s=steps * self._step_s,
            half_swings=fewest,
            first_m_s2=float(self._extremes[first]),
            switches_s=tuple(float(step * self._step_s) for step in switches),
        )

    def _hold(self, swings: Floats, tallies: Floats, commands: Floats, steps: Ints) -> tuple[Ints, Ints]:
        ends, taken = kernel.spread(
            swings, tallies, commands, steps, self._physics, self._limits, self._catch, self._aim
        )
        return ends, taken

    def _one_of_each_cell(self, swings: Floats, tallies: Floats, fineness: float) -> Ints:
        across, above = swings[:, 1] - swings[:, 0], swings[:, 2]
        across_m_s, above_m_s = swings[:, 4] - swings[:, 3], swings[:, 5]
        energy = self._gravity * above + 0.5 * (across_m_s**2 + above_m_s**2)
        coordinates = np.stack([swings[:, 0], swings[:, 3], np.arctan2(across, -above)], axis=1) / (fineness * CELL)
        directions = np.sign(across * above_m_s - above * across_m_s)
        columns = [*np.floor(coordinates + 0.5).T, directions, tallies[:, kernel.HALF_SWINGS]]
        code = np.zeros(len(swings))
        for column in columns:
            code = code * 1024.0 + column
        order = np.lexsort((-energy, code))
        first = np.ones(len(order), dtype=bool)
        first[1:] = code[order][1:] != code[order][:-1]
        return np.sort(order[first])

    def _moved(self, switches: Ints, steps: int) -> Ints:
        n = len(switches)
        single = [(i, i, move, 0) for i in range(n) for move in MOVES]
        pairs = itertools.combinations(range(n), 2) if n <= FEW else itertools.pairwise(range(n))
        double = [(i, j, a, b) for i, j in pairs for a in MOVES for b in MOVES]
        moved = np.tile(switches, (len(single) + len(double), 1))
        for candidate, (i, j, a, b) in zip(moved, single + double, strict=True):
            candidate[i] += a
            candidate[j] += b
        bounded = np.column_stack([np.zeros(len(moved), dtype=np.int64), moved, np.full(len(moved), steps)])
        return moved[(np.diff(bounded, axis=1) >= 0).all(axis=1)]

    def _steps_to_goal(self, switches: Ints, first: int, at_most: int) -> Ints:
        n = len(switches)
        edges = np.column_stack([np.zeros(n, dtype=np.int64), switches, np.full(n, at_most)])
        swings, tallies = np.tile(self._start, (n, 1)), np.zeros((n, kernel.TALLY))
        total, running, reached = np.zeros(n, dtype=np.int64), np.ones(n, dtype=bool), np.zeros(n, dtype=bool)
        for segment in range(edges.shape[1] - 1):
            command = self._extremes[(first + segment) % 2]
            steps = np.where(running, edges[:, segment + 1] - edges[:, segment], 0)
            ends, taken = self._hold(swings, tallies, np.full(n, command), steps)
            total += taken
            reached |= ends == kernel.GOAL
            running &= ends == kernel.DUE
        return np.where(reached, total, at_most + 1)


def _without_empty(switches: Ints) -> Ints:
    """Remove pairs of switches at one time, which are none."""
    kept: list[int] = []
    for switch in switches.tolist():
        if kept and kept[-1] == switch:
            kept.pop()
        else:
            kept.append(switch)
    return np.array(kept, dtype=np.int64)
