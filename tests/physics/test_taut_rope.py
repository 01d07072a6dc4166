"""The ball on a taut rope round the cup, by its angle alone."""

from __future__ import annotations

import cmath
import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from kendama_cli.physics.rope import CupProfile, pivot
from kendama_cli.physics.taut_rope import Ball, TautRope, rope_angle, rope_rate, time_scale
from kendama_cli.schema.settings import build
from kendama_cli.settings.game import CupSettings, GameSettings
from tests.physics.bare_rope import bare_rope
from tests.shipped_conf import plain

GAME = build(GameSettings, plain("game", "kendama"), "game")
ROPES = (
    TautRope.of(GAME),
    TautRope.round(CupProfile.of(build(CupSettings, plain("game/cup", "handle"), "cup")), 0.4),
    bare_rope(0.4),
)
angles = st.floats(-3.1, 3.1)


def near_a_turn(rope: TautRope, angle: float) -> bool:
    return any(abs(abs(angle) - rotation) < 2e-3 for rotation in rope.corners_rad)


@pytest.mark.parametrize("rope", ROPES)
@given(angle=angles)
def test_the_ball_is_where_the_rope_is_just_as_long_as_it_is(rope: TautRope, angle: float) -> None:
    ball = rope.ball(angle, 0.0)
    out, up, used = pivot(rope.cup, abs(ball.across_m), ball.above_m)
    assert used + math.hypot(abs(ball.across_m) - out, ball.above_m - up) == pytest.approx(0.4, abs=1e-9)
    assert math.atan2(ball.across_m, -ball.above_m) == pytest.approx(angle, abs=1e-9)


@pytest.mark.parametrize(("rope", "edges"), [(ROPES[0], 2), (ROPES[1], 3)])
def test_its_corners_are_the_angles_at_which_the_rope_comes_to_the_next_edge(rope: TautRope, edges: int) -> None:
    for corner in set(rope.corners_rad):
        balls = [rope.ball(corner + off, 0.0) for off in (-1e-7, 1e-7)]
        before, after = (pivot(rope.cup, one.across_m, one.above_m) for one in balls)
        assert before[2] < after[2]
    assert len(set(rope.corners_rad)) == edges


@pytest.mark.parametrize("rope", ROPES)
@given(angle=angles, rate=st.floats(-8, 8))
def test_its_velocity_is_how_its_place_changes(rope: TautRope, angle: float, rate: float) -> None:
    if near_a_turn(rope, angle):
        return
    h, ball = 1e-6, rope.ball(angle, rate)
    before, after = rope.ball(angle - h * rate, 0.0), rope.ball(angle + h * rate, 0.0)
    assert (after.across_m - before.across_m) / (2 * h) == pytest.approx(ball.across_m_s, abs=1e-6)
    assert (after.above_m - before.above_m) / (2 * h) == pytest.approx(ball.above_m_s, abs=1e-6)


@pytest.mark.parametrize("rope", ROPES)
@given(angle=angles, rate=st.floats(-8, 8), pull=st.floats(-8, 8))
def test_the_rest_of_its_acceleration_is_the_ropes_pull(rope: TautRope, angle: float, rate: float, pull: float) -> None:
    """Newton's law: what the pendulum's equation leaves of gravity and the cup's acceleration points along the rope."""
    if near_a_turn(rope, angle):
        return
    h, turning = 1e-4, rope.acceleration_rad_s2(angle, rate, pull, 9.81)
    ahead, past = (rope.ball(angle + s * rate + 0.5 * s * s * turning, 0.0) for s in (h, -h))
    ball = rope.ball(angle, rate)
    ax = (ahead.across_m - 2 * ball.across_m + past.across_m) / h**2 + pull
    az = (ahead.above_m - 2 * ball.above_m + past.above_m) / h**2 + 9.81
    out, up, used = pivot(rope.cup, abs(ball.across_m), ball.above_m)
    left = 0.4 - used
    n_x, n_z = (ball.across_m - math.copysign(out, ball.across_m)) / left, (ball.above_m - up) / left
    assert ax * n_z - az * n_x == pytest.approx(0.0, abs=2e-3)
    assert -(ax * n_x + az * n_z) == pytest.approx(rope.tension_m_s2(angle, rate, pull, 9.81), abs=2e-3)


def test_below_the_cup_it_is_a_pendulum() -> None:
    for rope in ROPES:
        desired = -(9.81 * math.sin(1.2) + 3.0 * math.cos(1.2)) / 0.4
        assert rope.acceleration_rad_s2(1.2, -2.0, 3.0, 9.81) == pytest.approx(desired, rel=1e-12)


@given(st.floats(-2, 2), st.floats(-2, 2), st.floats(-5, 5), st.floats(-5, 5))
def test_the_line_to_the_ball_turns_as_its_angle_does(x: float, z: float, vx: float, vz: float) -> None:
    """Counted from straight down, in complex numbers: (x + i z) / -i has the angle, its derivative the rate."""
    if math.hypot(x, z) < 1e-3:
        return
    hanging = complex(-z, x)
    assert rope_angle(x, z) == pytest.approx(cmath.phase(hanging))
    assert rope_rate(Ball(x, z, vx, vz)) == pytest.approx((complex(-vz, vx) / hanging).imag, abs=1e-9)


def test_a_rope_is_scaled_and_stretched_by_the_ball_that_hangs_on_it() -> None:
    assert TautRope.of(GAME, 1.1).length_m == pytest.approx(1.1 * GAME.rope.length_m)
    weight_n = GAME.ball.mass_kg * GAME.gravity_m_s2
    stretched_m = TautRope.hanging(GAME, 1.1).length_m - 1.1 * GAME.rope.length_m
    assert stretched_m * GAME.rope.stiffness_n_m == pytest.approx(weight_n)
    assert time_scale(1.44) == pytest.approx(1.2)
