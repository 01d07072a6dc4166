"""The law of the rope is given what the world has: places and velocities of tie and axis, not turns and rates."""

from __future__ import annotations

import numpy as np
import pytest

from kendama_cli.physics.rope import RopeLaw, rope_pull
from kendama_cli.schema.settings import build
from kendama_cli.settings.game import GameSettings
from kendama_cli.simulation.dart import rope_kernel
from tests.shipped_conf import plain

GAME = plain("game", "kendama")
COMPARED = 500


@pytest.mark.parametrize("cup", ["floor", "handle"])
def test_axis_and_rate_are_those_of_two_points_of_the_cup(cup: str) -> None:
    game = build(GameSettings, GAME | {"cup": plain("game/cup", cup)}, "game")
    law, rng, high = RopeLaw.of(game), np.random.default_rng(1), 0.035
    rope = np.array([*rope_kernel.rope_constants(law), 0.001, 0.0004, high])
    pulled, force, kinds = np.zeros(13), np.zeros(3), set()
    for _ in range(COMPARED):
        ball, speed, tie, tie_speed = rng.normal(0, [[0.25], [2.0], [0.05], [0.5]], (4, 3))
        axis = np.array([0.0, 0.0, 1.0]) + rng.normal(0, 0.3, 3)
        axis /= np.linalg.norm(axis)
        rate = np.cross(rng.normal(0, 3.0, 3), axis)
        over = (tie + high * axis, tie_speed + high * rate)
        assert rope_kernel.pull(ball, speed, tie, tie_speed, *over, rope, pulled, force)
        plain_pull = rope_pull(law, tuple(ball - tie), tuple(speed - tie_speed), tuple(axis), tuple(rate))
        drag = -(0.001 + 0.0004 * np.linalg.norm(speed)) * speed
        if plain_pull.tension_n == 0.0:
            assert pulled[rope_kernel.TENSION] == 0.0
            np.testing.assert_allclose(force, drag, rtol=1e-12)
            continue
        kinds.add(round(float(np.linalg.norm(plain_pull.pivot_m)), 6))
        # axis and rate pass through a difference of places: 1e-16 / 0.035 m, times up to 5 kN
        np.testing.assert_allclose(pulled[:3], plain_pull.force_n, rtol=1e-9, atol=1e-9)
        np.testing.assert_allclose(pulled[rope_kernel.REACTION : rope_kernel.PIVOT], -pulled[:3])
        np.testing.assert_allclose(pulled[rope_kernel.PIVOT : rope_kernel.SIDE], tie + plain_pull.pivot_m, atol=1e-12)
        np.testing.assert_allclose(force, pulled[:3] + drag, rtol=1e-12)
    assert len(kinds) == (3 if cup == "floor" else 4), "some way of the rope was never compared"


def test_a_ball_that_is_far_away_is_told() -> None:
    rope = np.array([*rope_kernel.rope_constants(RopeLaw.of(build(GameSettings, GAME, "game"))), 0.0, 0.0, 0.035])
    up, zero = np.array([0.0, 0.0, 0.035]), np.zeros(3)
    assert not rope_kernel.pull(np.array([2e4, 0, 0]), zero, zero, zero, up, zero, rope, np.zeros(13), np.zeros(3))


def test_with_a_tie_on_the_wall_too_however_the_cup_turns() -> None:
    game = build(GameSettings, GAME | {"cup": plain("game/cup", "side")}, "game")
    law, rng, high = RopeLaw.of(game), np.random.default_rng(2), 0.035
    out, height = law.cup.radius_m, law.cup.side_m
    rope = np.array([*rope_kernel.rope_constants(law), 0.001, 0.0004, high, height])
    pulled, force, heights = np.zeros(13), np.zeros(3), []
    for _ in range(COMPARED):
        ball, speed, position, place_speed, rate = rng.normal(0, [[0.25], [2.0], [0.05], [0.5], [3.0]], (5, 3))
        rotation = np.linalg.qr(rng.normal(size=(3, 3)))[0]
        rotation[:, 1] = np.cross(rotation[:, 2], rotation[:, 0])
        axis, side = rotation[:, 2], rotation[:, 0]
        knot = out * side + height * axis
        up = np.concatenate([position + high * axis, position + knot])
        up_speed = np.concatenate([place_speed + np.cross(rate, high * axis), place_speed + np.cross(rate, knot)])
        assert rope_kernel.pull(ball, speed, position, place_speed, up, up_speed, rope, pulled, force)
        plain_pull = rope_pull(
            law,
            tuple(ball - position),
            tuple(speed - place_speed),
            tuple(axis),
            tuple(np.cross(rate, axis)),
            tuple(side),
            tuple(np.cross(rate, side)),
        )
        drag = -(0.001 + 0.0004 * np.linalg.norm(speed)) * speed
        np.testing.assert_allclose(force, pulled[:3] + drag, rtol=1e-12)
        if plain_pull.tension_n == 0.0:
            assert pulled[rope_kernel.TENSION] == 0.0
            continue
        heights.append(float(np.dot(plain_pull.pivot_m, axis)))
        # by rounding another of two equal ways may be taken; none of these places is so near to that
        np.testing.assert_allclose(pulled[:3], plain_pull.force_n, rtol=1e-6, atol=1e-6)
        np.testing.assert_allclose(pulled[rope_kernel.REACTION : rope_kernel.PIVOT], -pulled[:3])
        np.testing.assert_allclose(
            pulled[rope_kernel.PIVOT : rope_kernel.SIDE], position + plain_pull.pivot_m, atol=1e-9
        )
    assert np.ptp(heights) > 0.99 * law.cup.rim_m, "some end of the cup was never compared"
