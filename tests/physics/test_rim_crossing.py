"""The rim's laws, held against scipy's rotations and against parabolas."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from kendama_cli.physics.rim_crossing import CATCH_SHARE, SampledWays, catch_from_s, is_caught, over_rim
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
