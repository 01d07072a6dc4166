"""Exploration: when a rollout explores, and what it tries instead of the greedy action."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple, Protocol

from numpy.random import Generator

from kendama_cli.learning.settings import ExplorationSettings, LearnSettings
from kendama_cli.learning.state import SwingState
from kendama_cli.learning.statistics import LearningCount
from kendama_cli.learning.task_settings import LimitedWorkspace

FOLLOWING_PER_S = 8.0
"""c of the law by which the cup follows a harmonic place: within about 1 / c."""


class Explorer(Protocol):
    """Actions of one exploring rollout."""

    def action(self, t_s: float, state: SwingState, greedy: int) -> int:
        """Return the action to choose at ``t_s`` into the rollout, where the table itself would choose ``greedy``."""


def explores(after_failure: float, count: LearningCount, rng: Generator, *, in_a_row: int = 1) -> bool:
    """Return True if the next rollout explores.

    Until any rollout has succeeded there is nothing to be greedy about; from then on only a greedy rollout that
    failed gives reason to, with the probability ``after_failure``, and then ``in_a_row`` rollouts explore.
    """
    if not count.succeeded_ever:
        return True
    if count.greedy_failed:
        return rng.random() < after_failure
    return 0 < count.explored_in_a_row < min(in_a_row, count.rollouts)  # all so far: until the first success


class DrawnHarmonic(NamedTuple):
    """A cos(w t + phase): what is sampled for one rollout."""

    frequency_rad_s: float
    amplitude: float
    """[m/s^2] where it drives the cup's acceleration, [m] where it drives the cup's position."""
    phase_rad: float


def drives_place(learn: LearnSettings) -> bool:
    """Return True if a harmonic drives the cup's position rather than its acceleration."""
    if learn.harmonic.drives == "auto":
        return not isinstance(learn.workspace, LimitedWorkspace)
    return learn.harmonic.drives == "position"


def draw_harmonic(learn: LearnSettings, rng: Generator) -> DrawnHarmonic:
    """Sample a harmonic from the ranges of ``learn.harmonic``."""
    settings = learn.harmonic
    scale = learn.workspace.half_width_m if drives_place(learn) else learn.max_action_m_s2
    frequency = rng.uniform(*settings.band_rad_s)
    amplitude = scale * rng.uniform(*settings.amplitude)
    uniform = rng.random()
    phase = math.copysign(0.5 * math.pi, uniform - 0.5) if settings.phase == "quarter" else 2.0 * math.pi * uniform
    return DrawnHarmonic(frequency, amplitude, phase)


def vary_harmonic(
    settings: ExplorationSettings, sampled: DrawnHarmonic, rng: Generator, *, succeeded: bool
) -> DrawnHarmonic:
    """Return ``sampled`` with another frequency and amplitude near by.

    Until anything has ``succeeded``, now and then farther off: small steps alone stay at near misses.
    """
    low, high = (1.0, 1.0) if succeeded else settings.spread_scales
    scale = low * (high / low) ** rng.random()
    frequency, amplitude = (scale * rng.standard_normal(2)).tolist()
    return sampled._replace(
        frequency_rad_s=sampled.frequency_rad_s * (1.0 + settings.frequency_spread * frequency),
        amplitude=sampled.amplitude * (1.0 + settings.amplitude_spread * amplitude),
    )


class Harmonic:
    """A harmonic drives the cup over a whole rollout (equations.md, Swing-up).

    Either its acceleration a = A cos(w t + phase), or its position x = A cos(w t + phase), which the acceleration
    x'' + 2 c (x' - v) + c^2 (x - x_cup) follows; the action nearest to that acceleration is chosen. A harmonic
    acceleration drifts out of a workspace that has no limiter, a harmonic place does not.
    """

    def __init__(self, learn: LearnSettings, sampled: DrawnHarmonic) -> None:
        self._actions = learn.actions_m_s2
        self._largest = learn.max_action_m_s2
        self._drives_place = drives_place(learn)
        self.drawn = sampled
        self._bang_bang = learn.harmonic.bang_bang

    def action(self, t_s: float, state: SwingState, greedy: int) -> int:
        """Return the action nearest to the harmonic's at ``t_s``; the greedy one has no effect."""
        w, amplitude, phase = self.drawn
        desired = amplitude * math.cos(w * t_s + phase)
        if self._drives_place:
            speed = -w * amplitude * math.sin(w * t_s + phase)
            ahead = desired - state.x_m
            desired = (
                -w * w * desired + 2.0 * FOLLOWING_PER_S * (speed - state.velocity_m_s) + FOLLOWING_PER_S**2 * ahead
            )
        if self._bang_bang:
            desired = math.copysign(self._largest, desired)
        return min(range(len(self._actions)), key=lambda action: abs(self._actions[action] - desired))


class EpsilonGreedy:
    """The greedy action, but with probability epsilon / (1 + k / decay) any of the actions."""

    def __init__(self, settings: ExplorationSettings, learn: LearnSettings, rollout: int, rng: Generator) -> None:
        self._epsilon = settings.epsilon / (1.0 + rollout / settings.decay_rollouts)
        self._n = len(learn.actions_m_s2)
        self._rng = rng

    def action(self, t_s: float, state: SwingState, greedy: int) -> int:
        """Return the greedy action or, with the probability epsilon, a random one; time and state have no effect."""
        if self._rng.random() < self._epsilon:
            return int(self._rng.integers(self._n))
        return greedy


def explorer(learn: LearnSettings, count: LearningCount, elite: Sequence[DrawnHarmonic], rng: Generator) -> Explorer:
    """Return a newly sampled explorer for the rollout after ``count``, of the kind that the settings name.

    ``elite`` are the harmonics to vary.
    """
    settings = learn.exploration
    if settings.kind == "epsilon_greedy":
        return EpsilonGreedy(settings, learn, count.rollouts, rng)
    if elite and rng.random() < settings.mutation_fraction:
        chosen = elite[int(rng.integers(len(elite)))]
        return Harmonic(learn, vary_harmonic(settings, chosen, rng, succeeded=count.succeeded_ever))
    return Harmonic(learn, draw_harmonic(learn, rng))
