"""A game of another size: the same flight of ball and rope, scaled in space and time."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest

from kendama_cli.physics.rope import RopeLaw, rope_pull
from kendama_cli.plugins.arms.smaller_game import similar_game
from kendama_cli.schema.settings import build
from kendama_cli.settings.game import GameSettings, LinearAir, MeasuredAir
from tests.shipped_conf import plain

GAME = build(GameSettings, plain("game", "kendama"), "game")
STILL = ((0.0, 0.0, 1.0), (0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 0.0, 0.0))
"""An upright cup that does not turn."""


def flown(game: GameSettings, unit_m: float, unit_s: float) -> np.ndarray:
    """The ball's path [unit_m] from a slack rope beside the cup into the taut rope and back over the rim."""
    law, (k1, k2) = RopeLaw.of(game), game.drag
    at, speed = np.array([0.3, 0.05, 0.1]) * unit_m, np.array([-2.0, 0.3, 3.0]) * unit_m / unit_s
    step_s, path = 1e-4 * unit_s, []
    for _ in range(6000):
        pull = rope_pull(law, tuple(at), tuple(speed), *STILL)
        drag = (k1 + k2 * math.sqrt(speed @ speed)) * speed
        speed = speed + step_s * ((np.array(pull.force_n) - drag) / game.ball.mass_kg - [0, 0, game.gravity_m_s2])
        at = at + step_s * speed
        path.append(at / unit_m)
    return np.array(path)


@pytest.mark.parametrize("air", [GAME.air, LinearAir("linear", 0.002), MeasuredAir("measured", 0.001, 5e-4)])
def test_motions_of_another_size_are_the_same_and_slower_by_its_root(air: object) -> None:
    game = dataclasses.replace(GAME, air=air)
    one, small = flown(game, 1.0, 1.0), flown(similar_game(game, 0.3), 0.3, math.sqrt(0.3))
    assert np.linalg.norm(one[-1] - one[0]) > 0.2  # it flies, and the rope takes it
    assert np.abs(np.linalg.norm(one, axis=1)).max() == pytest.approx(0.4, abs=0.05)
    assert small == pytest.approx(one, abs=1e-6)
