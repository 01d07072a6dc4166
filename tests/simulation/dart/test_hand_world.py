"""A cup that is carried: where it is, what the hand feels, and a ball that swings under it as a pendulum."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest

from kendama_cli.settings.game import LinearAir
from kendama_cli.simulation.dart.hand_world import HandWorld, carry_cup
from kendama_cli.simulation.dart.world import STEP_S
from tests.simulation.dart.bench_robot import kendama_game

GAME = dataclasses.replace(kendama_game(), air=LinearAir("linear", 0.0))
G, MASS = GAME.gravity_m_s2, GAME.ball.mass_kg


def test_the_cup_is_where_it_is_put_tilted_toward_x_and_the_hand_lifts_mass_times_gravity_and_acceleration() -> None:
    world = HandWorld(GAME)
    world.reset(np.array([0.1, -0.2, 0.3, 0.4]))
    assert world.ball.tie_m == pytest.approx([0.1, -0.2, 0.3])
    assert world.ball.axis == pytest.approx([math.sin(0.4), 0.0, math.cos(0.4)])
    assert world.force_n == pytest.approx([0.0, 0.0, -MASS * G])
    world.reset(np.zeros(4))
    felt = []
    for k in range(1, 401):
        world.step(np.array([0.0, 0.0, 0.5 * 2.0 * (k * STEP_S) ** 2, 0.0]))
        felt.append(world.force_n[2])
        assert world.t_s == pytest.approx(k * STEP_S)
        assert world.ball.tie_m == pytest.approx(world.place[:3], abs=1e-9)
    assert np.mean(felt[200:]) == pytest.approx(-MASS * (G + 2.0), rel=0.02)


def test_a_state_is_gone_back_to_and_goes_on_as_it_did() -> None:
    world = HandWorld(GAME)
    places = [np.array([0.05 * math.sin(9 * k * STEP_S), 0.0, 0.0, 0.1 * math.sin(5 * k * STEP_S)]) for k in range(300)]
    for place in places[:150]:
        world.step(place)
    kept, ends = world.moment(), []
    for _ in range(2):
        assert (world.t_s, world.place[0]) == (pytest.approx(0.15), places[149][0])
        for place in places[150:]:
            world.step(place)
        ends.append([*world.ball.position_m, *world.ball.velocity_m_s, *world.force_n, world.t_s])
        world.go_back(kept)
    assert ends[1] == pytest.approx(ends[0], abs=1e-9)


def test_under_a_resting_cup_the_ball_swings_on_the_given_rope_with_a_pendulum_s_period() -> None:
    t_s, cup_m = np.array([5.0, 5.4, 6.0]), np.array([[0.1, 0.2, 0.3]] * 3)
    swing = carry_cup(GAME, t_s, cup_m, rope_m=0.3, aside_m=0.02, after_s=1.0)
    assert swing.t_s == pytest.approx(STEP_S * np.arange(2001))
    assert swing.cup_m == pytest.approx(np.broadcast_to([0.1, 0.2, 0.3], (2001, 3)))
    assert swing.ball_m[0] == pytest.approx([0.12, 0.2, 0.3 - math.sqrt(0.3003**2 - 0.02**2)], abs=2e-4)
    side = swing.ball_m[:, 0] - 0.1
    crossings = swing.t_s[1:][np.diff(np.sign(side)) != 0]
    half_s = math.pi * math.sqrt(0.3 / G)
    assert crossings[:3] == pytest.approx(half_s * np.array([0.5, 1.5, 2.5]), rel=0.01)
    assert not swing.slack.any()
    assert (swing.caught, swing.caught_later, swing.miss_m) == (False, False, None)
    moved = carry_cup(
        GAME, t_s, np.array([[0.0, 0, 0], [0.2, 0, 0], [0.2, 0, 0]]), rope_m=None, aside_m=0.0, after_s=0.1
    )
    assert moved.cup_m[200] == pytest.approx([0.1, 0.0, 0.0], abs=1e-9)
    assert moved.ball_m[0] == pytest.approx(
        [0.0, 0.0, -GAME.rope.length_m - MASS * G / GAME.rope.stiffness_n_m], abs=1e-9
    )
