"""A rope with mass, as a chain of links in DART's world, beside a spring and the laws of mechanics."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from kendama_cli.errors import ConfigError
from kendama_cli.physics.rope import CupProfile
from kendama_cli.physics.rope_chain import laid, link_lengths_m, node_masses_kg
from kendama_cli.schema.settings import build
from kendama_cli.settings.game import GameSettings, LinearAir
from kendama_cli.simulation.dart.arm_errors import WorldErrors
from kendama_cli.simulation.dart.hand_world import carry_cup
from kendama_cli.simulation.dart.world import ArmWorld
from kendama_cli.simulation.swingup.rail import CompiledRail
from tests.shipped_conf import plain
from tests.simulation.dart.bench_robot import bench_arm, kendama_game

GAME = build(GameSettings, plain("game", "kendama"), "game")
STILL = dataclasses.replace(GAME, air=LinearAir("linear", 0.0))
Way = Callable[[Any], Any]


def of_mass(game: GameSettings, rope_kg: float) -> GameSettings:
    return dataclasses.replace(game, rope=dataclasses.replace(game.rope, mass_kg=rope_kg))


def cup_ways(cup_x: Way, until_s: float) -> tuple[np.ndarray, np.ndarray]:
    t_s = np.arange(0.0, until_s, 0.001)
    return t_s, np.column_stack([cup_x(t_s), np.zeros_like(t_s), np.zeros_like(t_s)])


def balls_m(game: GameSettings, cup_x: Way, until_s: float, rope_kg: float) -> np.ndarray:
    """Where the ball is, every millisecond, under a cup that is carried along x."""
    path = cup_ways(cup_x, until_s)
    return carry_cup(of_mass(game, rope_kg), *path, rope_m=None, aside_m=0.0, after_s=0.0).ball_m


def test_a_chain_hangs_and_pulls_the_cup_by_the_weight_of_ball_and_rope() -> None:
    """At rest the wrist carries 10 g of rope more than 50 g of ball alone."""
    pulls = []
    for rope_kg in (0.0, 1e-2):
        world = ArmWorld(bench_arm(), of_mass(kendama_game(), rope_kg))
        rest, home = np.zeros(len(world.arm.joint_names)), world.arm.home_rad
        for _ in range(300):
            world.step(home, rest, rest)
        assert world.ball.tension_n == pytest.approx(9.81 * (0.05 + world.ball.chain.end_kg), rel=2e-3)
        pulls.append(-world.ball.pulled[6])
    assert pulls[1] - pulls[0] == pytest.approx(9.81 * 1e-2, rel=0.03)


def test_a_twin_may_have_a_heavier_rope_than_its_model_and_loses_it_again() -> None:
    world = ArmWorld(bench_arm(), kendama_game())
    assert world.ball.chain.rope_kg == 0.0
    world.perturb(WorldErrors(rope_kg=1e-3))
    assert world.ball.chain.rope_kg == 1e-3
    world.perturb(WorldErrors())
    assert world.ball.chain.rope_kg == 0.0


def test_links_are_laid_round_the_cup_and_share_the_mass() -> None:
    profile = CupProfile.of(GAME.cup)
    lengths = link_lengths_m(0.4, profile.used_m, 24)
    assert node_masses_kg(1e-3, lengths).sum() == pytest.approx(1e-3)
    for ball in ([0.05, 0.1, -0.2], [0.2, 0.0, 0.1], [0.0, -0.01, 0.2]):
        positions = laid(profile, lengths, np.array(ball), np.array([0.0, 0.0, 1.0]))
        ends = np.array([profile.path_length_m(*position) for position in positions])
        whole = profile.path_length_m(*ball)
        assert positions[-1] == pytest.approx(ball)
        np.testing.assert_allclose(ends, np.append(0.0, np.cumsum(lengths)) * whole / 0.4, atol=1e-9)


def test_a_rope_with_mass_is_refused_on_the_rail_and_where_it_is_too_light() -> None:
    with pytest.raises(ConfigError, match=r"on the rail the rope has no mass; choose simulation/rope=spring"):
        CompiledRail(of_mass(GAME, 5e-4), 0.002)
    with pytest.raises(ConfigError, match=r"'mass_kg' is 1e-06; allowed: 0, a spring without mass, or 1e-05 to 0.02"):
        of_mass(GAME, 1e-6)
