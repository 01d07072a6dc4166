"""The rim's laws, held against scipy's rotations and against parabolas."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from kendama_cli.physics.rim_crossing import (
    CATCH_SHARE,
    FITTED_S,
    NEAR_M,
    TAUT_SHARE,
    SampledWays,
    at_rim_m,
    catch_from_s,
    falls,
    falls_in,
    is_caught,
    is_inside,
    near_descent,
    over_rim,
    planned_descent,
)
from kendama_cli.settings.game import HandleTie
from tests.simulation.dart.bench_robot import kendama_game

GAME = kendama_game()
HANDLE = dataclasses.replace(GAME, cup=dataclasses.replace(GAME.cup, tie=HandleTie("handle", 0.06, 0.012)))
UP = np.array([0.0, 0.0, 1.0])


@pytest.mark.parametrize("seed", range(10000, 10005))
def test_a_place_over_the_rim_is_that_of_the_cups_own_axes(seed: int) -> None:
    rng = np.random.default_rng(seed)
    axis = rng.normal(size=3)
    axis /= np.linalg.norm(axis)
    across = np.cross(UP, axis)
    rotation = Rotation.from_rotvec(across / np.linalg.norm(across) * math.acos(axis[2]))
    apart = rng.normal(size=3)
    assert over_rim(apart, axis, 0.13) == pytest.approx(rotation.inv().apply(apart) - [0, 0, 0.13], abs=1e-9)
    rows = over_rim(np.tile(apart, (4, 1)).T, np.tile(axis, (4, 1)).T, 0.13)
    assert np.array(rows)[:, 2] == pytest.approx(rotation.inv().apply(apart) - [0, 0, 0.13], abs=1e-9)


@pytest.mark.parametrize("game", [GAME, HANDLE], ids=["floor", "handle"])
@pytest.mark.parametrize(
    ("period_s", "noise_m", "bound_m"), [(0.001, 0.0, 2e-4), (0.01, 0.0, 2e-4), (0.004, 1e-3, 5e-3)]
)
def test_a_sampled_fall_reaches_the_rim_where_its_parabola_does(
    game, period_s: float, noise_m: float, bound_m: float
) -> None:
    """On a cup that leans by 0.3 rad and moves at 0.2 m/s, wherever the samples lie; tracked to 1 mm, within 5 mm."""
    axis = np.array([math.sin(0.3), 0.0, math.cos(0.3)])
    across = np.array([math.cos(0.3), 0.0, -math.sin(0.3)])
    errors = []
    for seed in range(10000, 10020):
        rng = np.random.default_rng(seed)
        t = np.arange(0.0, 0.6, period_s) + rng.uniform(0, period_s)
        cup = np.outer(t, [0.2, 0.0, 0.0])
        height = 0.3 + 0.8 * t - 9.81 / 2 * t**2
        fall = (0.8 + math.sqrt(0.64 + 2 * 9.81 * 0.3)) / 9.81
        ball = cup + np.outer(0.02 - 0.1 * t, across) + np.outer(height + game.cup.rim_m, axis)
        ball = ball + rng.normal(0.0, noise_m, ball.shape) if noise_m else ball
        miss = SampledWays(t, cup, np.tile(axis, (len(t), 1)), ball).miss_m(game, 0.0)
        assert miss is not None
        errors.append(abs(miss[0] - (0.02 - 0.1 * fall)))
    assert max(errors) < bound_m


@pytest.mark.parametrize("across_m_s", [0.5, 4.0])
def test_a_ball_that_grazes_the_rims_plane_never_came_down_beyond_the_rope(across_m_s: float) -> None:
    """It rises half a millimetre over the plane, so that it falls at 0.1 m/s there: 4 m/s would lead it 0.8 m away.

    Within 10 %: the slope is that of the last sample before, at most one of the ten periods of the graze.
    """
    t = np.arange(0.0, 0.6, 0.001) + 0.0003
    height = GAME.cup.rim_m + GAME.ball.radius_m + 5e-4 - 9.81 / 2 * (t - 0.3) ** 2
    ball = np.column_stack([across_m_s * (t - 0.3), 0 * t, height])
    ways = SampledWays(t, 0 * ball, np.tile(UP, (len(t), 1)), ball)
    assert ways.miss_m(GAME, 0.0) == pytest.approx((across_m_s * (0.01 + GAME.ball.radius_m / 0.1), 0.0), rel=0.1)
    assert (ways.miss_m(GAME, 0.0, GAME.rope.length_m) is None) == (across_m_s == 4.0)


def test_the_planned_catch_is_sought_after_a_share_of_the_way() -> None:
    t = np.linspace(0.0, 2.0, 201)
    cup = np.column_stack([np.minimum(t, 1.0), 0 * t, 0 * t])
    assert catch_from_s(t, cup) == pytest.approx(CATCH_SHARE, abs=0.011)
    assert catch_from_s(t, 0 * cup) == 0.0


@pytest.mark.parametrize(("miss", "caught"), [((0.044, 0.0), True), ((0.04, 0.03), False), (None, False)])
def test_a_ball_is_caught_whose_descent_led_into_the_mouth(miss, caught: bool) -> None:
    assert is_caught(True, miss, GAME.cup.radius_m) == caught
    assert not is_caught(False, miss, GAME.cup.radius_m)


@pytest.mark.parametrize("period_s", [0.004, 0.01, 0.021])
def test_a_noisy_fall_is_fitted_over_its_last_part(period_s: float) -> None:
    """Fall by numpy's parabola through what is above the plane in the last FITTED_S, and straight on at its slope.

    Of fewer than four samples by the straight line through the two about the plane.
    """
    rng = np.random.default_rng(10004)
    t = np.arange(0.0, 0.5, period_s) + 0.0007
    fall = np.column_stack([0.01 - 0.1 * t, 0.02 + 0.05 * t, 0.09 + 0.9 * t - 9.81 / 2 * t**2])
    over = fall + rng.normal(0.0, 5e-4, fall.shape)
    ball = over + np.array([0.0, 0.0, GAME.cup.rim_m])
    k = int(np.flatnonzero(falls(over[:-1, 2] - GAME.ball.radius_m, over[1:, 2] - GAME.ball.radius_m))[0])
    last = (t > t[k] - FITTED_S) & (t <= t[k])
    if last.sum() >= 4:
        (x, y, z), (vx, vy, vz) = (np.polyfit(t[last] - t[k], over[last], 2)[row] for row in (-1, -2))
        wanted = x - vx * z / vz, y - vy * z / vz
    else:
        wanted = tuple(over[k, :2] + (over[k + 1] - over[k])[:2] * over[k, 2] / (over[k, 2] - over[k + 1, 2]))
        assert period_s == 0.021
        assert at_rim_m(over[k], over[k + 1]) == pytest.approx(wanted)
    made = SampledWays(t, 0 * ball, np.tile(UP, (len(t), 1)), ball)
    assert made.miss_m(GAME, 0.0) == pytest.approx(wanted)
    # where its rope may be taut it was no flight
    length = np.linalg.norm([GAME.cup.outer_radius_m - np.hypot(*over[k, :2]), over[k, 2]])
    length += GAME.cup.outer_radius_m + GAME.cup.rim_m
    assert made.miss_m(GAME, 0.0, 1.001 * length / TAUT_SHARE) is not None
    assert made.miss_m(GAME, 0.0, 0.999 * length / TAUT_SHARE) is None


def test_the_planned_descent_is_the_first_since_then_or_the_last_before() -> None:
    assert [planned_descent((0.1, 0.5, 0.9), since) for since in (0.0, 0.5, 0.51, 0.95)] == [0, 1, 2, 2]
    assert planned_descent((), 0.3) is None


def test_the_descent_to_mark_is_near_the_cup() -> None:
    """Falls through the plane at 0.2, 0.5 and 0.8 s; of the cup's path CATCH_SHARE lies before 0.6 s."""
    t = np.arange(100) / 100
    height = np.where(np.isin(np.arange(100), [*range(10, 20), *range(40, 50), *range(70, 80)]), 0.05, -0.05)
    cup = np.column_stack([t, 0 * t])
    near, far = 0 * t + 0.07, 0 * t + 0.0715  # along both axes
    for late, wanted in ((near, 79), (far, 49)):
        beside = np.where(t > 0.7, late, near)
        assert math.hypot(0.07, 0.07) < NEAR_M < math.hypot(0.0715, 0.0715)
        assert near_descent(t, cup, (beside, -beside, height)) == wanted
    assert near_descent(t, cup, (far, far, height)) is None


def test_inside_and_into_the_mouth_end_at_wall_floor_and_rim() -> None:
    cup = HANDLE.cup
    middle = 0.5 * (cup.floor_m + cup.rim_m)
    for place, inside in (
        ((0.7 * cup.radius_m, -0.7 * cup.radius_m, middle), True),
        ((0.71 * cup.radius_m, 0.71 * cup.radius_m, middle), False),
        ((0.0, 0.0, cup.floor_m + 1e-6), True),
        ((0.0, 0.0, cup.floor_m - 1e-6), False),
        ((0.0, 0.0, cup.rim_m - 1e-6), True),
        ((0.0, 0.0, cup.rim_m + 1e-6), False),
    ):
        assert is_inside(np.array(place), cup) == inside
    falling = {"x_m": -0.3, "across_m": -0.02, "over_m": -0.0019, "rising_m_s": -2.0, "mouth_m": 0.03, "edge_m": 0.3}
    assert falls_in(**falling, step_s=0.001)
    for change in ({"x_m": -0.301}, {"across_m": 0.031}, {"over_m": 0.0021}, {"rising_m_s": 2.0}):
        assert not falls_in(**falling | change, step_s=0.001)
