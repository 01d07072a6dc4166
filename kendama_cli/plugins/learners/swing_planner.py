"""A search for a swing in a fitted model: what it would come to there, if the model were right."""

from __future__ import annotations

import math

import numpy as np
from numpy.random import Generator

from kendama_cli.learning.parameter_search import parameter_search
from kendama_cli.learning.reward import Window as GoalWindow
from kendama_cli.learning.settings import LearnSettings
from kendama_cli.learning.task_settings import LimitedWorkspace
from kendama_cli.motion.braking import BRAKING_SHARE, BrakingLimiter
from kendama_cli.physics.taut_rope import TautRope
from kendama_cli.plugins.learners import swing_model_kernel as kernel
from kendama_cli.plugins.learners.settings import ModelBasedSettings
from kendama_cli.plugins.learners.swing_model import SwingModel
from kendama_cli.schema.arrays import Array

STEP_S = 0.01
"""Time step of a swing in the model."""
HELD = 3
"""Such steps for which an acceleration is held; on the way up the bins change about as often."""
EDGE = 0.9
"""Where leaving the workspace ends a rollout, the share of it that a swing may use."""
ANGLES = 361
"""Rows of the toy's table, from 0 to 180 degrees."""
NEAR = 0.2
"""Where a search begins, as a share of the ranges' spread."""


class SwingPlanner:
    """Search for the swing (w, c, A) of least cost, averaged over a model's uncertainty and a rollout's start.

    What a release is worth follows from the toy as the settings have it: the pull of a taut rope, and the landing of a
    ball that flies freely. Only the way there is learned.
    """

    def __init__(self, settings: LearnSettings) -> None:
        assert isinstance(settings.learner, ModelBasedSettings)
        self._own, noise = settings.learner, settings.noise
        self._noise = np.array([math.radians(noise.start_angle_deg), noise.start_position_m, noise.acceleration])
        self._cup, self._window = _cup(settings), _window(settings)
        self._toy = _toy(settings)
        ranges = np.array([self._own.frequency_rad_s, self._own.chirp_rad_s2, self._own.amplitude])
        ranges[2] *= settings.workspace.half_width_m
        self._middle, self._spread = ranges.mean(axis=1), 0.5 * (ranges[:, 1] - ranges[:, 0])

    def drawn(self, rng: Generator) -> Array:
        """Sample a swing (3,) from the ranges, to explore."""
        return np.asarray(self._draws(1, 1.0, rng)[0])

    def _draws(self, n: int, width: float, rng: Generator) -> Array:
        swings: Array = self._middle + width * self._spread * rng.uniform(-1.0, 1.0, (n, 3))
        return swings

    def found(self, model: SwingModel, near: Array | None, rng: Generator) -> Array:
        """Return the best swing of searches about the best of many that are sampled, and about ``near`` if given."""
        own = self._own
        mean, root = model.fitted()
        weights = mean + np.einsum("pnk,mk->mpn", root, rng.standard_normal((own.models, root.shape[2])))
        starts = self._noise * rng.standard_normal((own.models, 3)) + np.array([0.0, 0.0, 1.0])
        drawn = self._draws(own.candidates, 2.0, rng)
        begins = [drawn[int(np.argmin(self._costs(drawn, weights, starts)))], *([] if near is None else [near])]
        found = [self._improved(swing, weights, starts, int(rng.integers(2**31))) for swing in begins]
        return found[int(np.argmin(self._costs(np.array(found), weights, starts)))]

    def _improved(self, middle: Array, weights: Array, starts: Array, seed: int) -> Array:
        own, spread = self._own, NEAR * self._spread
        search = parameter_search("cma", 3, seed, generation=own.population, elite=own.population, reward_cost=1.0)
        costs: list[list[float]] = []
        for _ in range(own.generations):
            swings = middle + spread * search.after(costs).proposals
            costs.append(self._costs(swings, weights, starts).tolist())
        swing: Array = middle + spread * search.after(costs).best
        return swing

    def _costs(self, swings: Array, weights: Array, starts: Array) -> Array:
        found: Array = kernel.costs(swings, starts, weights, self._toy, self._cup, self._window)
        return found


def _cup(settings: LearnSettings) -> kernel.Cup:
    workspace = settings.workspace
    largest = max(settings.max_action_m_s2, settings.goal.catch_acceleration_m_s2)
    limited = isinstance(workspace, LimitedWorkspace)
    return kernel.Cup(
        limiter=BrakingLimiter(
            half_width_m=workspace.half_width_m if limited else math.inf,
            max_speed_m_s=workspace.max_speed_m_s,
            braking_m_s2=workspace.braking_m_s2 if isinstance(workspace, LimitedWorkspace) else BRAKING_SHARE * largest,
            max_m_s2=largest,
            period_s=STEP_S,
        ),
        lowest_m_s2=settings.actions_m_s2[0],
        highest_m_s2=settings.actions_m_s2[-1],
        edge_m=math.inf if limited else EDGE * workspace.half_width_m,
        ahead_s=settings.decision.max_s,
        held=HELD,
        steps=round(settings.rollout_s / STEP_S),
    )


def _window(settings: LearnSettings) -> kernel.Window:
    goal, assumed = settings.goal, settings.learner
    assert isinstance(assumed, ModelBasedSettings)
    return kernel.Window(
        goal=GoalWindow.of(goal),
        gravity_m_s2=assumed.game.gravity_m_s2,
        rim_m=assumed.game.cup.rim_m,
        landing_limit_m=goal.landing_limit_m,
        catch_acceleration_m_s2=goal.catch_acceleration_m_s2,
    )


def _toy(settings: LearnSettings) -> Array:
    """Return the kendama by its angle (ANGLES, 7).

    Columns: the rope's direction, its tension per rate^2, the ball's position and path per rate.
    """
    assert isinstance(settings.learner, ModelBasedSettings)
    rope, rows = TautRope.of(settings.learner.game), []
    for angle in np.linspace(0.0, math.pi, ANGLES).tolist():
        ball = rope.ball(angle, 1.0)
        still, across, along = (
            rope.tension_m_s2(angle, *rest) for rest in ((0.0, 0.0, 1.0), (0.0, 1.0, 0.0), (1.0, 0.0, 0.0))
        )
        rows.append([-across, -still, along, *ball])
    return np.array(rows)
