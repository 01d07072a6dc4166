"""The core's rope as a chain of links in DART's world beside MuJoCo's of the same mass."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from kendama_cli.settings.game import GameSettings
from tests.plugins.mujoco.cross_check.test_referee import seen
from tests.simulation.dart.test_rope_chain_kernel import GAME, STILL, Way, balls_m

HANGING_M = [0.0, 0.0, -(GAME.rope.length_m + GAME.ball.mass_kg * GAME.gravity_m_s2 / GAME.rope.stiffness_n_m)]


def swinging(t_s: Any) -> Any:
    """Below the cup all the time."""
    return 0.15 * (1 - np.cos(5.0 * np.asarray(t_s)))


def set_going(t_s: Any) -> Any:
    """To 4 m/s within 0.1 s: the ball swings up beside the cup, over the tie."""
    begun_s = np.minimum(np.asarray(t_s), 0.1)
    return 4.0 * (0.5 * begun_s**2 / 0.1 + np.asarray(t_s) - begun_s)


@pytest.mark.parametrize(
    ("game", "cup_x", "until_s", "apart_m", "light_m", "heavy_m"),
    [(GAME, swinging, 0.7, 0.1e-3, 0.05e-3, 0.3e-3), (STILL, set_going, 0.6, 3e-3, 3e-3, 3.5e-3)],
)
def test_the_chain_swings_as_mujocos_of_the_same_mass_and_a_light_one_as_a_spring(  # noqa: PLR0917
    game: GameSettings, cup_x: Way, until_s: float, apart_m: float, light_m: float, heavy_m: float
) -> None:
    """Measured under the cup: 0.07 mm from MuJoCo's, 0.01 from a spring's with 0.01 g, 0.4 with 0.5 g.

    Round the cup's edges 2.3, 2.1 and 4.0 mm: our edges are round, and the spring's way has no mass at all.
    """
    spring, light, heavy = (balls_m(game, cup_x, until_s, rope_kg) for rope_kg in (0.0, 1e-5, 5e-4))
    theirs = seen(game, cup_x, HANGING_M, until_s, 5e-4)
    t_s = np.arange(0.0, until_s, 0.001)
    same = np.column_stack([np.interp(theirs.t_s, t_s, column) for column in heavy.T])
    assert np.linalg.norm(same - theirs.ball_m, axis=1).max() < apart_m
    assert np.linalg.norm(light - spring, axis=1).max() < light_m
    assert np.linalg.norm(heavy - spring, axis=1).max() > heavy_m
