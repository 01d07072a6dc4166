"""The swing-up's environment: exact dynamics, bounded workspace, chance that is drawn beforehand."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from kendama_cli.errors import ConfigError, SimulationError
from kendama_cli.learning.sarsa import SarsaLearner
from kendama_cli.learning.state import SwingState
from kendama_cli.physics.rope import RopeLaw, rope_pull
from kendama_cli.settings.game import LinearAir
from kendama_cli.simulation.swingup.engine import rate
from kendama_cli.simulation.swingup.environment import SwingUpEnvironment
from kendama_cli.simulation.swingup.rail import CompiledRail
from tests.learning.settings_files import game_settings, learn_settings

STEP_S = 0.002
GAME = game_settings()
STILL = dataclasses.replace(GAME, air=LinearAir("linear", 0.0))


class Scripted:
    """Acts by a list of accelerations, each held for ``period_s``."""

    decides_on_bins = False

    def __init__(self, commands: list[float], period_s: float = 0.04) -> None:
        self._commands = commands
        self._period_s = period_s
        self.next_look_s = -math.inf

    def act(self, state: SwingState, t_s: float) -> float:
        self.next_look_s = t_s
        return self._commands[int(t_s / self._period_s) % len(self._commands)]


def euler(state: np.ndarray, command: float) -> np.ndarray:
    """One step of (cup x, ball x, ball z, their rates): v += dt a(old state), q += dt v, forces of eq. 1."""
    mass = GAME.ball.mass_kg
    position, speed = state[:3], state[3:]
    apart = position[1:] - (position[0], 0.0)
    exerted = rope_pull(RopeLaw.of(GAME), (apart[0], 0.0, apart[1]), (speed[1] - speed[0], 0.0, speed[2]))
    linear, quadratic = GAME.drag
    force = -(linear + quadratic * float(np.hypot(*speed[1:]))) * speed[1:]
    if exerted.tension_n > 0.0:
        force = force + np.array([exerted.force_n[0], exerted.force_n[2]])
    speed = speed + STEP_S * np.array([command, *(force / mass - (0.0, GAME.gravity_m_s2))])
    return np.concatenate([position + STEP_S * speed, speed])


def whole_state(swing: CompiledRail) -> np.ndarray:
    """(cup x, ball x, ball z, their rates)."""
    ball_x, ball_v = swing.x_m + swing.across_m, swing.velocity_m_s + swing.across_m_s
    return np.array([swing.x_m, ball_x, swing.above_m, swing.velocity_m_s, ball_v, swing.above_m_s])


ACTIONS = st.lists(st.sampled_from([-8.0, -4.0, 0.0, 4.0, 8.0]), min_size=10, max_size=10)


@settings(max_examples=15, deadline=None)
@given(ACTIONS, st.floats(-3.1, 3.1), st.floats(-6.0, 6.0))
def test_every_step_of_the_rail_is_one_of_semi_implicit_euler(actions, angle, turning):
    # from the same state, so that the chaos of a rope that snaps taut does not enlarge the rounding of earlier steps
    swing = CompiledRail(GAME, STEP_S)
    swing.start(SwingState(0.01, -0.2, angle, turning))
    for command in np.repeat(actions, 100):
        desired = euler(whole_state(swing), command)
        swing.step(command)
        np.testing.assert_allclose(whole_state(swing), desired, rtol=0, atol=1e-12)


@pytest.mark.parametrize("seed", range(5))
def test_the_rail_follows_semi_implicit_euler_to_a_micrometre_over_three_seconds(seed):
    rng = np.random.default_rng(seed)
    swing = CompiledRail(GAME, STEP_S)
    swing.start(SwingState(0.01, 0.0, rng.uniform(1.8, 2.5), 0.0))
    state, tensions = whole_state(swing), []
    for action in rng.choice([-8.0, -4.0, 4.0, 8.0], 8):
        for command in np.repeat([action, -action, -action, action], 52):  # the cup comes back each time
            state = euler(state, command)
            swing.step(command)
            tensions.append(swing.tension_n)
            # 1 to 20 nm at first: every time that the rope snaps taut enlarges the rounding of earlier steps
            np.testing.assert_allclose(whole_state(swing)[:3], state[:3], rtol=0, atol=1e-6)
    assert len(tensions) * STEP_S > 3.0
    assert min(tensions) == 0.0 < max(tensions)  # slack and taut phases


@pytest.mark.parametrize("angle_deg", [30.0, 80.0, 120.0, 150.0, 175.0])
def test_without_drag_a_released_ball_never_rises_higher_than_it_was(angle_deg):
    swing = CompiledRail(STILL, STEP_S)
    swing.start(SwingState(0.0, 0.0, math.radians(angle_deg), 0.0))
    start_m, heights = swing.above_m, []
    for _ in range(5000):
        swing.step(0.0)
        heights.append(swing.above_m)
    # the rope's static stretch (0.25 mm) is the energy that it starts with
    assert max(heights) <= start_m + 0.25e-3
    assert max(heights[2500:]) <= start_m + 0.25e-3


def test_a_taut_swing_keeps_its_height_and_the_pendulums_period():
    swing = CompiledRail(STILL, STEP_S)
    swing.start(SwingState(0.0, 0.0, math.radians(5.0), 0.0))
    angles = []
    for _ in range(5000):
        swing.step(0.0)
        angles.append(math.atan2(swing.across_m, -swing.above_m))
    assert max(angles[4000:]) == pytest.approx(math.radians(5.0), rel=0.02)
    crossings = np.flatnonzero(np.diff(np.sign(angles)) < 0)
    period_s = float(np.diff(crossings).mean()) * STEP_S
    assert period_s == pytest.approx(2 * math.pi * math.sqrt(0.40025 / 9.81), rel=2e-3)


def test_a_hanging_ball_pulls_with_its_weight():
    swing = CompiledRail(GAME, STEP_S)
    for _ in range(500):
        swing.step(0.0)
    assert swing.tension_n == pytest.approx(0.05 * 9.81, rel=1e-9)
    assert rate(swing) == 0.0


def test_a_freely_flying_ball_feels_no_rope():
    swing = CompiledRail(STILL, STEP_S)
    swing.start(SwingState(0.0, 0.0, math.pi, 0.0))
    swing.step(0.0)
    for _ in range(50):
        swing.step(0.0)
    assert swing.tension_n == 0.0


def rollout_of(seed: int, environment: SwingUpEnvironment) -> object:
    learner = SarsaLearner(learn_settings())
    learner.begin_rollout(np.random.default_rng(seed))
    return environment.roll_out(learner, environment.noise(np.random.default_rng(seed)))


def test_a_rollout_depends_on_nothing_that_came_before():
    used = SwingUpEnvironment(learn_settings(), GAME)
    first = [rollout_of(seed, used) for seed in (1, 2, 3)]
    assert rollout_of(1, used) == first[0]
    assert rollout_of(3, SwingUpEnvironment(learn_settings(), GAME)) == first[2]
    assert first[0] != first[1]


@settings(max_examples=15, deadline=None)
@given(st.lists(st.sampled_from([-8.0, 8.0]), min_size=3, max_size=100), st.integers(0, 2**32))
def test_with_the_limiter_the_cup_stays_inside_whatever_is_commanded_and_however_noisy(commands, seed):
    environment = SwingUpEnvironment(learn_settings(), GAME)
    rollout = environment.roll_out(Scripted(commands), environment.noise(np.random.default_rng(seed)))
    assert rollout.outcome != "outside"
    assert rollout.peak_displacement_m <= 0.4 + 1e-4


@pytest.mark.parametrize("scale", [0.85, 1.1])
def test_a_scaled_workspace_has_its_edges_elsewhere(scale):
    for name, outcome in (("easy", "timeout"), ("paper_caught", "outside")):
        environment = SwingUpEnvironment(learn_settings(name), GAME)
        noise = dataclasses.replace(environment.noiseless(), workspace_scale=scale)
        rollout = environment.roll_out(Scripted([8.0]), noise)
        assert rollout.outcome == outcome
        edge_m = learn_settings(name).workspace.half_width_m
        assert rollout.peak_displacement_m == pytest.approx(edge_m * scale, abs=2.0 * STEP_S)


def test_where_leaving_terminates_the_rollout_ends_there():
    environment = SwingUpEnvironment(learn_settings("paper_caught"), GAME)
    rollout = environment.roll_out(Scripted([8.0]), environment.noiseless())
    assert rollout.outcome == "outside"
    assert 0.3 < rollout.peak_displacement_m < 0.3 + 2.0 * STEP_S + 1e-9
    assert rollout.duration_s < 0.6


def test_standing_still_times_out_without_a_half_swing():
    environment = SwingUpEnvironment(learn_settings(), GAME)
    rollout = environment.roll_out(Scripted([0.0]), environment.noiseless())
    assert rollout.outcome == "timeout"
    assert rollout.duration_s == pytest.approx(4.0)
    assert rollout.half_swings == 0
    assert rollout.peak_displacement_m == 0.0


def test_half_swings_are_counted_at_each_turn_of_the_ball():
    environment = SwingUpEnvironment(learn_settings(rollout_s=2.0), GAME)
    noise = dataclasses.replace(environment.noiseless(), start_angle_rad=math.radians(40.0))
    rollout = environment.roll_out(Scripted([0.0]), noise)
    # 2 s over half a period of 0.635 s, lengthened by 3 % at 40 degrees
    assert rollout.half_swings == 4


def test_a_validation_adds_another_body_to_the_same_noise():
    environment = SwingUpEnvironment(learn_settings(), GAME)
    validation = environment.settings.validation.randomisation
    offsets, gains, narrower, noisier = [], [], [], []
    for seed in range(60):
        usual = environment.noise(np.random.default_rng(seed))
        other = environment.noise(np.random.default_rng(seed), validation=True)
        noise_scale = other.start_angle_rad / usual.start_angle_rad
        noisier.append(noise_scale)
        rest = np.array(other.angle_rad) - noise_scale * np.array(usual.angle_rad)
        assert np.ptp(rest) < 1e-12, "one offset for the whole rollout"
        offsets.append(math.degrees(rest[0]))
        ratio = np.array(other.gain) / (1.0 + noise_scale * (np.array(usual.gain) - 1.0))
        assert np.ptp(ratio) < 1e-12
        gains.append(ratio[0] - 1.0)
        assert usual.workspace_scale == 1.0
        narrower.append(1.0 - other.workspace_scale)
    assert min(noisier) >= 0.0
    assert min(narrower) >= 0.0, "never wider: what is learned stays inside"
    # the largest of 60 uniform draws falls short of the end by more than a tenth with a probability of 0.9^60 = 0.2 %
    for sampled, maximum in (
        (offsets, validation.angle_deg),
        (gains, validation.acceleration),
        (narrower, validation.workspace_shrink),
        (noisier, validation.noise[1]),
    ):
        assert 0.9 * maximum < max(map(abs, sampled)) <= maximum + 1e-12


@pytest.mark.parametrize("stiffness_n_m", [2000.0, 12500.0])
def test_the_damped_rope_is_passive_up_to_the_stiffness_that_is_allowed(stiffness_n_m):
    rope = dataclasses.replace(GAME.rope, stiffness_n_m=stiffness_n_m)
    swing = CompiledRail(dataclasses.replace(STILL, rope=rope), STEP_S)
    for angle_deg in range(100, 180, 8):
        swing.start(SwingState(0.0, 0.0, math.radians(angle_deg), 0.0))
        start_m = swing.above_m
        for _ in range(2000):
            swing.step(0.0)
            assert swing.above_m <= start_m + 0.25e-3


def test_a_rope_too_stiff_for_the_time_step_is_refused_in_one_line():
    stiff = dataclasses.replace(GAME, rope=dataclasses.replace(GAME.rope, stiffness_n_m=20000.0))
    with pytest.raises(ConfigError, match=r"'learn.step_s' is 0.002; allowed: at most 0.001581 s for a rope of 20000"):
        SwingUpEnvironment(learn_settings(), stiff)


def test_a_state_that_is_no_number_is_refused_and_not_learned_from():
    environment = SwingUpEnvironment(learn_settings(), GAME)
    noise = dataclasses.replace(environment.noiseless(), start_angle_rad=math.nan)
    with pytest.raises(SimulationError, match=r"left its domain at .* s \(extent nan m\); lower learn.step_s"):
        environment.roll_out(Scripted([0.0]), noise)


def test_the_cup_meets_the_ball_where_the_goal_says_it_is_catchable():
    environment = SwingUpEnvironment(learn_settings(), GAME)
    noise = dataclasses.replace(environment.noiseless(), start_angle_rad=0.0)
    learner = SarsaLearner(learn_settings())
    rng = np.random.default_rng(4)
    misses = []
    for _ in range(60):
        learner.begin_rollout(rng)
        rollout = environment.roll_out(learner, noise)
        learner.end_rollout(rollout.outcome, rollout.final)
        if rollout.outcome == "goal":
            misses.append(rollout.catch.miss_m)
    assert len(misses) > 20
    # the mouth is 25 mm around the ball's centre; caught were 0.97 of the flights of 80 learned tables
    assert np.mean(np.array(misses) < 0.025) > 0.7


def test_exploring_by_a_harmonic_path_stays_inside_where_a_harmonic_acceleration_drifts_out():
    outside = {}
    for drives, amplitude in (("position", [0.4, 0.7]), ("acceleration", [0.6, 1.0])):
        chosen = learn_settings("paper_caught", harmonic__drives=drives, harmonic__amplitude=amplitude)
        environment, rng = SwingUpEnvironment(chosen, GAME), np.random.default_rng(0)
        outcomes = []
        for _ in range(40):
            learner = SarsaLearner(chosen)  # nothing has succeeded yet: it explores
            learner.begin_rollout(rng)
            outcomes.append(environment.roll_out(learner, environment.noise(rng)).outcome)
        outside[drives] = outcomes.count("outside") / len(outcomes)
    assert outside["position"] < 0.3
    assert outside["acceleration"] > 0.7
