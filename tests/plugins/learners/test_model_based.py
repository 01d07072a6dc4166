"""The model-based learner: its model finds the pendulum without knowing of one, and a swing found in it is played."""

from __future__ import annotations

import math

import numpy as np
import pytest

from kendama_cli.learning.learners import begin_learner
from kendama_cli.learning.state import SwingState
from kendama_cli.physics.taut_rope import TautRope
from kendama_cli.plugins.learners import swing_model_kernel as kernel
from kendama_cli.plugins.learners.swing_model import NODES, SwingModel
from kendama_cli.plugins.learners.swing_planner import SwingPlanner
from kendama_cli.simulation.swingup.environment import SwingUpEnvironment
from tests.learning.settings_files import game_settings, learn_settings

HARD = learn_settings("hard", "learn/learner=model_based")
ANGLES = np.linspace(0.0, math.pi, NODES)


@pytest.fixture(scope="module")
def learned():
    """A learner after 30 rollouts, or as soon as ten in a row succeeded."""
    environment, rng = SwingUpEnvironment(HARD, game_settings()), np.random.default_rng(10702)
    learner = begin_learner(HARD)
    while not learner.count.learned and learner.count.rollouts < 30:
        learner.begin_rollout(rng)
        rollout = environment.roll_out(learner, environment.noise(rng))
        learner.end_rollout(rollout.outcome, rollout.final, None if rollout.catch is None else rollout.catch.miss_m)
    return learner


def test_a_few_rollouts_bring_ten_catches_in_a_row(learned):
    assert learned.count.learned  # chance: 0.25 % of rollouts (docs/results/learning.md)


def test_the_model_is_that_of_the_pendulum_where_the_ball_has_been(learned):
    mean, _ = learned._model.fitted()
    rope = TautRope.hanging(game_settings())
    still = np.array([rope.acceleration_rad_s2(angle, 0.0, 0.0, 9.81) for angle in ANGLES])
    pushed = np.array([rope.acceleration_rad_s2(angle, 0.0, 1.0, 9.81) for angle in ANGLES]) - still
    seen = slice(1, 10)  # to 90 deg; above only the last swings have been
    assert mean[0, seen] == pytest.approx(still[seen], rel=0.15)
    assert mean[3, seen] == pytest.approx(pushed[seen], abs=0.5)


def test_a_fit_is_as_sure_as_it_is_right():
    truth = np.zeros((4, NODES))
    truth[0], truth[2], truth[3] = -24.5 * np.sin(ANGLES), -0.1, -2.5 * np.cos(ANGLES)
    model, rng, h = SwingModel(0.01, 0.05), np.random.default_rng(4), 0.002
    for _ in range(4):
        x = v = angle = rate = 0.0
        times, readings = [], []
        frequency = rng.uniform(3.5, 4.5)
        for k in range(2000):
            if k % 20 == 0:
                times.append(k * h)
                noisy = angle + 0.01 * rng.standard_normal(), rate + 0.05 * rng.standard_normal()
                readings.append(SwingState(x, v, *noisy))
                cup = 3.0 * math.sin(frequency * k * h)
            rate += h * kernel.acceleration(truth, angle, rate, cup)
            angle, x, v = angle + h * rate, x + h * v, v + h * cup
        model.add(times, readings)
    highest = max(abs(reading.angle_rad) for reading in readings)
    mean, root = model.fitted()
    sigma = np.sqrt((root**2).sum(axis=2))
    seen = slice(1, int(highest / ANGLES[1]))
    assert sigma[0, seen].max() < 0.1 * 24.5
    errors = (mean - truth)[[0, 3]][:, seen] / sigma[[0, 3]][:, seen]
    assert np.sqrt((errors**2).mean()) < 3.0


def test_what_no_rollout_has_shown_stays_open():
    _, root = SwingModel(0.01, 0.05).fitted()
    assert np.sqrt((root[0] ** 2).sum(axis=1)).min() > 10.0  # rad/s^2: beside the pendulum's 24.5


def test_a_drawn_swing_is_worse_in_the_model_than_the_one_that_is_found(learned):
    planner, rng = SwingPlanner(HARD), np.random.default_rng(0)
    mean, _ = learned._model.fitted()
    swings = np.array([planner.found(learned._model, None, rng), *(planner.drawn(rng) for _ in range(20))])
    costs = planner._costs(swings, mean[None], np.array([[0.0, 0.0, 1.0]]))
    assert costs[0] < -0.5 < np.median(costs[1:])
