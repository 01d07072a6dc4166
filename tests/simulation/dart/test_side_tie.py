"""A tie on the cup's wall in DART: where the ball hangs, and that cup and ball feel opposite forces."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from kendama_cli.physics.rope import RopeLaw, rope_pull
from kendama_cli.schema.settings import build
from kendama_cli.settings.game import GameSettings, LinearAir, SideTie
from kendama_cli.simulation.dart.hand_world import HandWorld
from kendama_cli.simulation.dart.world import STEP_S
from tests.shipped_conf import plain

VALUES = plain("game", "kendama") | {"cup": plain("game/cup", "side")}
GAME = dataclasses.replace(build(GameSettings, VALUES, "game"), air=LinearAir("linear", 0.0))
UPRIGHT = np.zeros(4)


def test_the_ball_hangs_under_the_tie_and_stays_there() -> None:
    cup = dataclasses.replace(GAME.cup, tie=SideTie("side", 0.055, 90.0))
    world = HandWorld(dataclasses.replace(GAME, cup=cup))
    for _ in range(300):
        world.step(UPRIGHT)
    stretched = GAME.rope.length_m + GAME.ball.mass_kg * GAME.gravity_m_s2 / GAME.rope.stiffness_n_m
    assert world.ball.position_m == pytest.approx([0.0, cup.outer_radius_m, 0.015 - stretched], abs=1e-9)
    assert world.force_n == pytest.approx([0.0, 0.0, -GAME.ball.mass_kg * GAME.gravity_m_s2], abs=1e-9)


def test_the_ball_goes_round_the_wall_as_the_plain_law_says() -> None:
    """A ball that is flung past the cup's far side, round it and over it, beside the plain law by the same steps."""
    world, law, mass = HandWorld(GAME), RopeLaw.of(GAME), GAME.ball.mass_kg
    position, speed = np.array([-0.05, 0.25, -0.2]), np.array([-3.5, 0.0, 1.0])
    world.ball.put(position.tolist(), speed.tolist())
    touched = set()
    for _ in range(900):
        exerted = rope_pull(law, tuple(position.tolist()), tuple(speed.tolist()))
        force = np.array(exerted.force_n)
        if exerted.tension_n > 0.0:
            touched.add(tuple(np.round(exerted.pivot_m, 3).tolist()))
        speed = speed + STEP_S * (force / mass - [0.0, 0.0, GAME.gravity_m_s2])
        position = position + STEP_S * speed
        world.step(UPRIGHT)
        assert world.ball.position_m == pytest.approx(position, abs=1e-7)
        assert world.force_n == pytest.approx(-force, abs=1e-4)
    assert len(touched) > 20, "the rope hardly moved over the cup"
