"""The search for the best swing: nothing else that is tried is faster, and what is out of reach is said beforehand."""

from __future__ import annotations

import math

import numpy as np
import pytest

from kendama_cli.errors import ConfigError
from kendama_cli.learning.decision import GreedyPolicy
from kendama_cli.learning.sarsa import SarsaLearner
from kendama_cli.learning.state import SwingState
from kendama_cli.simulation.swingup.best_swing import best_swing
from kendama_cli.simulation.swingup.environment import SwingUpEnvironment
from tests.learning.settings_files import game_settings, learn_settings

GAME = game_settings()


class Switching:
    """Bang-bang: ``first`` until the first of ``switches_s``, then the other extreme, and so on."""

    decides_on_bins = False
    next_look_s = -math.inf

    def __init__(self, first: float, switches_s: tuple[float, ...]) -> None:
        self._first = first
        self._switches_s = switches_s

    def act(self, state: SwingState, t_s: float) -> float:
        self.next_look_s = t_s
        switched = sum(t_s >= switch - 1e-9 for switch in self._switches_s)
        return -self._first if switched % 2 else self._first


@pytest.mark.parametrize("name", ["easy", "hard"])
def test_the_swing_that_was_found_succeeds_at_the_time_that_was_found(name):
    bound = best_swing(learn_settings(name), GAME)
    environment = SwingUpEnvironment(learn_settings(name), GAME)
    rollout = environment.roll_out(Switching(bound.first_m_s2, bound.switches_s), environment.noiseless())
    assert rollout.outcome == "goal"
    assert rollout.duration_s == pytest.approx(bound.time_to_goal_s, abs=1e-9)
    assert rollout.half_swings >= bound.half_swings


@pytest.mark.parametrize("name", ["easy"])
def test_no_swing_by_chance_is_sooner_or_swings_less(name):
    chosen = learn_settings(name, rollout_s=2.0)
    bound = best_swing(chosen, GAME)
    environment, rng = SwingUpEnvironment(chosen, GAME), np.random.default_rng(0)
    times, half_swings = [], []
    for _ in range(200):
        first, near = rng.choice([-8.0, 8.0]), np.array(bound.switches_s)
        if rng.random() < 0.5:
            switches = np.cumsum(rng.uniform(0.05, 0.6, 6))
        else:
            first, switches = bound.first_m_s2, np.sort(near + 0.06 * rng.standard_normal(len(near)))
        rollout = environment.roll_out(Switching(float(first), tuple(switches.tolist())), environment.noiseless())
        if rollout.outcome == "goal":
            times.append(rollout.duration_s)
            half_swings.append(rollout.half_swings)
    assert len(times) >= 3
    assert min(times) >= bound.time_to_goal_s
    assert min(half_swings) >= bound.half_swings


def test_what_is_learned_is_slower_than_what_was_found():
    chosen = learn_settings()
    bound = best_swing(chosen, GAME)
    environment, learner = SwingUpEnvironment(chosen, GAME), SarsaLearner(chosen)
    rng = np.random.default_rng(5)
    while not learner.count.finished(chosen.count):
        learner.begin_rollout(rng)
        rollout = environment.roll_out(learner, environment.noise(rng))
        learner.end_rollout(rollout.outcome, rollout.final)
    rollout = environment.roll_out(GreedyPolicy(learner.policy, chosen), environment.noiseless())
    assert rollout.outcome == "goal"
    assert bound.time_to_goal_s < rollout.duration_s < 3.0 * bound.time_to_goal_s
    assert rollout.half_swings >= bound.half_swings


def test_a_ball_that_may_only_swing_wide_needs_one_half_swing_and_the_time_of_an_arc():
    # A goal of 20 deg +-1 deg: the cup pulls away at 8 m/s^2, and in the cup's frame the ball is a pendulum about
    # atan(8 / 9.81), so that angle'' = (8 cos(angle) - 9.81 sin(angle)) / l; integrated here for itself.
    chosen = learn_settings(
        goal__angle_deg=20.0, goal__tolerance_deg=1.0, goal__success="reached", goal__min_rate_rad_s=0.1
    )
    angle = rate = t_s = 0.0
    while angle < math.radians(19.0):
        rate += 1e-5 * (8.0 * math.cos(angle) - 9.81 * math.sin(angle)) / 0.40025
        angle += 1e-5 * rate
        t_s += 1e-5
    bound = best_swing(chosen, GAME)
    assert bound.half_swings == 1
    assert bound.switches_s == ()
    assert bound.time_to_goal_s == pytest.approx(t_s, abs=0.005)


def test_weaker_limits_never_make_it_sooner():
    times = [
        best_swing(learn_settings(actions_m_s2=[-a, 0.0, a], workspace__braking_m_s2=0.9 * a), GAME).time_to_goal_s
        for a in (10.0, 8.0, 6.0)
    ]
    assert times == sorted(times)
    assert times[0] < times[-1]


@pytest.mark.parametrize(
    ("replaced", "limits"),
    [
        ({"rollout_s": 0.6}, "of up to 0.6 s with accelerations of -8 to 8 m/s^2 within 0.4 m"),
        ({"workspace__half_width_m": 0.02}, "of up to 4 s with accelerations of -8 to 8 m/s^2 within 0.02 m"),
        ({"goal__min_rate_rad_s": 40.0, "goal__max_rate_rad_s": 50.0, "rollout_s": 1.0}, "of up to 1 s"),
    ],
)
def test_a_goal_out_of_reach_is_said_in_one_line(replaced, limits):
    with pytest.raises(ConfigError) as caught:
        best_swing(learn_settings(**replaced), GAME)
    assert limits in str(caught.value)
    assert "'learn.goal' is out of reach" in str(caught.value)
    assert "widen learn.goal, or allow more" in str(caught.value)
    assert "\n" not in str(caught.value)
