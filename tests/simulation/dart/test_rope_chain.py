"""A rope with mass, as a chain of links in DART's world, beside a spring, MuJoCo's chain and the laws of mechanics."""

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
from kendama_cli.simulation.dart.carried_cup import carry_cup
from kendama_cli.simulation.dart.world import ArmWorld
from kendama_cli.simulation.dart.world_errors import WorldErrors
from kendama_cli.simulation.swingup.rail import CompiledRail
from tests.shipped_conf import plain
from tests.simulation.dart.bench_robot import kendama_game, pa10

GAME = build(GameSettings, plain("game", "kendama"), "game")
STILL = dataclasses.replace(GAME, air=LinearAir("linear", 0.0))
HANGING_M = [0.0, 0.0, -(GAME.rope.length_m + GAME.ball.mass_kg * GAME.gravity_m_s2 / GAME.rope.stiffness_n_m)]
Way = Callable[[Any], Any]


def of_mass(game: GameSettings, rope_kg: float) -> GameSettings:
    return dataclasses.replace(game, rope=dataclasses.replace(game.rope, mass_kg=rope_kg))


def cup_ways(cup_x: Way, until_s: float) -> tuple[np.ndarray, np.ndarray]:
    t_s = np.arange(0.0, until_s, 0.001)
    return t_s, np.column_stack([cup_x(t_s), np.zeros_like(t_s), np.zeros_like(t_s)])


def balls_m(game: GameSettings, cup_x: Way, until_s: float, rope_kg: float) -> np.ndarray:
    """Where the ball is, every millisecond, under a cup that is carried along x."""
    way = cup_ways(cup_x, until_s)
    return carry_cup(of_mass(game, rope_kg), *way, rope_m=None, aside_m=0.0, after_s=0.0).ball_m


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
    pytest.importorskip("mujoco", reason="mujoco (the extra 'referee') is not installed")
    from tests.simulation.test_referee import seen  # noqa: PLC0415 - needs MuJoCo

    spring, light, heavy = (balls_m(game, cup_x, until_s, rope_kg) for rope_kg in (0.0, 1e-5, 5e-4))
    theirs = seen(game, cup_x, HANGING_M, until_s, 5e-4)
    t_s = np.arange(0.0, until_s, 0.001)
    same = np.column_stack([np.interp(theirs.t_s, t_s, column) for column in heavy.T])
    assert np.linalg.norm(same - theirs.ball_m, axis=1).max() < apart_m
    assert np.linalg.norm(light - spring, axis=1).max() < light_m
    assert np.linalg.norm(heavy - spring, axis=1).max() > heavy_m


def test_a_chain_hangs_and_pulls_the_cup_by_the_weight_of_ball_and_rope() -> None:
    """At rest the wrist carries 10 g of rope more than 50 g of ball alone."""
    pulls = []
    for rope_kg in (0.0, 1e-2):
        world = ArmWorld(pa10(), of_mass(kendama_game(), rope_kg))
        rest, home = np.zeros(len(world.arm.joint_names)), world.arm.home_rad
        for _ in range(300):
            world.step(home, rest, rest)
        assert world.ball.tension_n == pytest.approx(9.81 * (0.05 + world.ball.chain.end_kg), rel=2e-3)
        pulls.append(-world.ball.pulled[6])
    assert pulls[1] - pulls[0] == pytest.approx(9.81 * 1e-2, rel=0.03)


def test_a_twin_may_have_a_heavier_rope_than_its_model_and_loses_it_again() -> None:
    world = ArmWorld(pa10(), kendama_game())
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
        places = laid(profile, lengths, np.array(ball), np.array([0.0, 0.0, 1.0]))
        ends = np.array([profile.way_m(*place) for place in places])
        whole = profile.way_m(*ball)
        assert places[-1] == pytest.approx(ball)
        np.testing.assert_allclose(ends, np.append(0.0, np.cumsum(lengths)) * whole / 0.4, atol=1e-9)


def test_a_rope_with_mass_is_refused_on_the_rail_and_where_it_is_too_light() -> None:
    with pytest.raises(ConfigError, match=r"on the rail the rope has no mass; choose simulation/rope=spring"):
        CompiledRail(of_mass(GAME, 5e-4), 0.002)
    with pytest.raises(ConfigError, match=r"'mass_kg' is 1e-06; allowed: 0, a spring without mass, or 1e-05 to 0.02"):
        of_mass(GAME, 1e-6)
