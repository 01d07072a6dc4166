"""The engine of the whole arm: it follows what is commanded, and what it does is beside the cup on a rail."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence

import numpy as np
import pytest

from kendama_cli.errors import ConfigError
from kendama_cli.learning.settings import LearnSettings
from kendama_cli.learning.state import SwingState
from kendama_cli.learning.task_settings import DartEngine
from kendama_cli.schema.arrays import Array
from kendama_cli.simulation.swingup.arm import ArmSwing
from kendama_cli.simulation.swingup.engine import SwingEngine, limiter
from kendama_cli.simulation.swingup.rail import CompiledRail
from tests.learning.settings_files import game_settings, learn_settings
from tests.simulation.dart.bench_robot import bench_arm

GAME = game_settings()
START = SwingState(0.003, 0.0, 0.04, 0.0)


def dart_settings() -> LearnSettings:
    return dataclasses.replace(learn_settings(), engine=DartEngine("dart", bench_arm()))


@pytest.fixture(scope="module")
def arm() -> ArmSwing:
    return ArmSwing(bench_arm(), dart_settings(), GAME)


def swung(swing: SwingEngine, actions: Sequence[float], state: SwingState = START) -> Array:
    """Place of the cup, its reference, angle of the ball and tension under ``actions`` of 0.1 s each, every step."""
    limit, seen = limiter(learn_settings()).limit, []
    swing.start(state)
    for action in actions:
        for _ in range(50):
            swing.step(limit(action, *swing.reference))
            angle = math.atan2(swing.across_m, -swing.above_m)
            seen.append([swing.x_m, swing.reference[0], angle, swing.tension_n])
    return np.array(seen)


def test_the_arm_carries_the_cup_where_it_is_commanded_and_keeps_it_inside(arm: ArmSwing) -> None:
    actions = np.random.default_rng(1).choice([-8.0, -4.0, 0.0, 4.0, 8.0], 30)
    x_m, reference_m, _, _ = swung(arm, actions.tolist()).T
    # reversals between 8 m/s^2 jerk the wrist; measured 1.0 to 1.7 mm
    assert np.abs(x_m - reference_m).max() < 0.003
    assert np.abs(x_m).max() > 0.3
    assert np.abs(x_m).max() < 0.4 + 0.003


def test_the_arm_s_ball_swings_as_the_one_on_the_rail_but_for_the_arm_s_own_errors(arm: ArmSwing) -> None:
    actions = [4.0, 4.0, -4.0, -8.0, -8.0, 0.0, 8.0, 8.0]
    of_arm, of_rail = swung(arm, actions), swung(CompiledRail(GAME, 0.002), actions)
    # steps of 1 and 2 ms and millimetres of the cup: the angles stay within what a reading's noise hides (1 deg)
    assert np.abs(of_arm[:, 2] - of_rail[:, 2]).max() < math.radians(2.0)
    assert np.abs(of_rail[:, 2]).max() > math.radians(40)
    hanging = GAME.ball.mass_kg * GAME.gravity_m_s2
    assert of_arm[:10, 3] == pytest.approx(hanging, rel=0.2)


def test_a_rollout_does_not_depend_on_those_before_it(arm: ArmSwing) -> None:
    actions = [8.0, -8.0, -8.0, 8.0, 4.0, 8.0, -8.0, -4.0, 0.0, 8.0]
    swung(arm, [-8.0, 8.0] * 8, SwingState(-0.01, 0.0, 2.8, 0.0))
    once = swung(arm, actions)
    assert (once == swung(ArmSwing(bench_arm(), dart_settings(), GAME), actions)).all()
    assert (once == swung(arm, actions)).all()


def test_a_ball_that_falls_onto_the_cup_bounces_off_it(arm: ArmSwing) -> None:
    """From over the cup with a slack rope: on the rail it would fall through."""
    arm.start(SwingState(0.0, 0.0, math.pi, 0.0))
    lowest = math.inf
    for _ in range(400):
        arm.step(0.0)
        lowest = min(lowest, arm.above_m)
    assert lowest > 0.0
    assert abs(arm.across_m) < GAME.cup.radius_m
    assert arm.in_cup


def test_a_ball_that_hangs_is_not_in_the_cup_and_another_rope_hangs_lower(arm: ArmSwing) -> None:
    hanging = []
    for scale in (1.0, 1.05):
        arm.take_on(scale, 1.0)
        arm.start(SwingState(0.0, 0.0, 0.0, 0.0))
        assert not arm.in_cup
        hanging.append(arm.above_m)
    arm.take_on(1.0, 1.0)
    assert hanging[1] == pytest.approx(hanging[0] - 0.05 * GAME.rope.length_m, abs=1e-6)


def test_a_state_is_read_as_it_was_put_with_the_ball_on_its_stretched_rope_in_the_plane(arm: ArmSwing) -> None:
    state = SwingState(0.1, -0.4, 0.7, 2.0)
    arm.start(state)
    length = GAME.rope.length_m + GAME.ball.mass_kg * GAME.gravity_m_s2 / GAME.rope.stiffness_n_m
    out, up = math.sin(0.7), -math.cos(0.7)
    assert (arm.x_m, arm.velocity_m_s, *arm.reference) == pytest.approx((0.1, -0.4, 0.1, -0.4), abs=1e-6)
    assert (arm.across_m, arm.above_m) == pytest.approx((length * out, length * up), abs=1e-6)
    assert (arm.across_m_s, arm.above_m_s) == pytest.approx((-2.0 * length * up, 2.0 * length * out), abs=1e-5)
    ball = arm._world.ball
    assert ball.position_m[1] == pytest.approx(ball.tie_m[1], abs=1e-9)
    assert ball.velocity_m_s == pytest.approx([arm.across_m_s + arm.velocity_m_s, 0.0, arm.above_m_s], abs=1e-6)


def test_a_time_step_that_is_none_of_the_world_s_is_refused() -> None:
    settings = dataclasses.replace(dart_settings(), step_s=0.0015)
    with pytest.raises(ConfigError, match=r"'learn\.step_s' is 0\.0015; allowed .*: multiples of 0\.001"):
        ArmSwing(bench_arm(), settings, GAME)
