"""Steps in which nothing can touch, made by compiled code: the arm and the ball move as DART moves them."""

from __future__ import annotations

import dataclasses
import math
from typing import Any

import numpy as np
import pytest

from kendama_cli.schema.arrays import Array
from kendama_cli.schema.settings import build
from kendama_cli.settings.game import CupSettings, GameSettings
from kendama_cli.settings.robot import RobotSettings
from kendama_cli.simulation.dart.arm_errors import WorldErrors
from kendama_cli.simulation.dart.world import STEP_S, ArmWorld
from tests.shipped_conf import plain
from tests.simulation.dart.bench_robot import bench_arm, kendama_game
from tests.simulation.dart.compiled_arm import left_to_dart


def watched(world: ArmWorld, *, always_held: bool = False) -> list[bool]:
    """True for each step that was one of DART's; ``always_held``: all are, and it finds all friction."""
    looked: list[bool] = []
    if always_held:
        left_to_dart(world)
    follow = world._control.follow

    def followed(*arguments: Any) -> Array | None:
        after = follow(*arguments)
        looked.append(after is None)
        return after

    world._control.follow = followed  # type: ignore[method-assign, assignment]
    return looked


def swayed(
    robot: RobotSettings, *, always_held: bool, steps: int = 700, game: GameSettings | None = None
) -> tuple[Array, list[bool]]:
    """Joints and ball (steps, 10) while all joints sway through zero speed, and in which steps DART looked."""
    world = ArmWorld(robot, game or kendama_game(), links=True)
    looked = watched(world, always_held=always_held)
    positions = []
    for k in range(1, steps):
        t = k * STEP_S
        rotation = 0.1 * (1 - math.cos(8 * t)), 0.8 * math.sin(8 * t), 6.4 * math.cos(8 * t)
        world.step(world.arm.home_rad + rotation[0], *(np.full(7, one) for one in rotation[1:]))
        positions.append(np.concatenate([world.position_rad, world.ball.position_m]))
    return np.array(positions), looked


@pytest.mark.parametrize(
    ("viscous", "rounding_rad"),
    # DART applies constraints after viscous friction, compiled code beside it: 5 Nms of it are T B = 0.5 % of 1 kg m^2
    # where DART finds the friction, rotors are carried by the rope's pull of the step before
    [((0.0,) * 7, 2e-6), (bench_arm().viscous_nm_s, 2e-5)],
    ids=["without viscous friction", "as shipped"],
)
def test_an_arm_moves_as_if_dart_had_looked_for_contacts_and_friction_in_every_step(
    viscous: tuple[float, ...], rounding_rad: float
) -> None:
    robot = dataclasses.replace(bench_arm(), viscous_nm_s=viscous)
    apart, looked = swayed(robot, always_held=False)
    touching, always = swayed(robot, always_held=True)
    assert np.mean(looked) < 0.2
    assert all(always)
    assert np.abs(apart - touching).max() < rounding_rad


def test_compiled_code_makes_the_step_that_dart_makes_of_the_same_forces() -> None:
    """A rope that is taut and slack, leaning gravity, a tie that rubs, a light ball: 700 steps, to rounding."""
    seen, errors = [], WorldErrors(
        gravity_tilt_rad=0.05, gravity_tilt_y_rad=-0.03, tie_friction_m=1e-3, mass_scale=0.7, ball_start_m=0.2,
        joint_friction_nm=0.5, rope_scale=1.1, drag_scale=2.0,
    )  # fmt: skip
    for near in (False, True):
        world = ArmWorld(bench_arm(), kendama_game())
        if near:  # so large that the ball is always by the cup
            world._arrays.radii[-1] = 1e3
        world.perturb(errors)
        world.reset(world.arm.home_rad)
        world.ball.put(world.ball.position_m, [1.5, 0.3, 2.5])
        looked, states = watched(world), []
        for k in range(1, 700):
            t = k * STEP_S
            place, speed, change = 0.1 * (1 - math.cos(8 * t)), 0.8 * math.sin(8 * t), 6.4 * math.cos(8 * t)
            world.step(world.arm.home_rad + place, *(np.full(7, one) for one in (speed, change)))
            ball = world.ball
            cup = np.concatenate([ball.tie_m, ball.tie_m_s, ball.axis, [ball.tension_n], world.wrist_wrench()])
            states.append(np.concatenate([world.position_rad, ball.position_m, ball.velocity_m_s, cup]))
        assert np.mean(looked) == near
        seen.append(np.array(states))
    compiled, dart = seen
    assert 50 < (dart[:, 22] == 0.0).sum() < 680
    assert np.abs(compiled - dart).max() < 1e-10, "measured: 6e-12 N of tension"


def test_a_tie_on_the_cups_wall_pulls_alike_whether_dart_looks_or_not_and_lies_under_no_axis() -> None:
    """DART tells where the tie is and how fast, compiled code finds both by itself from the joints."""
    robot = dataclasses.replace(bench_arm(), viscous_nm_s=(0.0,) * 7)
    game = dataclasses.replace(kendama_game(), cup=build(CupSettings, plain("game/cup", "side"), "cup"))
    apart, looked = swayed(robot, always_held=False, steps=300, game=game)
    touching, always = swayed(robot, always_held=True, steps=300, game=game)
    assert not all(looked)
    assert all(always)
    assert np.abs(apart - touching).max() < 2e-6, "measured: 9e-7, of the rope's pull of the step before"
    assert np.abs(apart - swayed(robot, always_held=False, steps=300)[0]).max() > 0.04, "as with a tie on the axis"


def test_a_ball_in_the_cup_of_an_arm_that_stops_moves_as_if_dart_had_found_friction_and_contacts_together() -> None:
    """It falls in while all joints turn, which then stop dead and rest under it: friction slides and holds."""
    seen = []
    for always_held in (False, True):
        world = ArmWorld(bench_arm(), kendama_game(), links=True)
        looked = watched(world, always_held=always_held)
        home, still, states = world.arm.home_rad, np.zeros(7), []
        for k in range(1, 500):
            if k == 50:
                world.ball.put((world.ball.tie_m + np.array([0.0, 0.0, 0.15])).tolist(), [0.0, 0.0, -2.0])
            t = min(k, 250) * STEP_S
            speed, change = (0.3 * math.sin(6 * t), 1.8 * math.cos(6 * t)) if k < 250 else (0.0, 0.0)
            world.step(home + 0.05 * (1 - math.cos(6 * t)), still + speed, still + change)
            states.append(np.concatenate([world.position_rad, world.ball.position_m]))
        assert all(looked[60:])
        assert world.ball.is_in_cup()
        # at rest: measured 1.3e-5 to 1.7e-5, and 2.3e-3 where friction does not know that the ball presses on the cup
        assert np.abs(world.velocity_rad_s).max() < 2e-5
        seen.append(np.array(states))
    compiled, held = seen
    assert np.abs(held[60:, :7] - held[60, :7]).max() > 0.04
    # 2e-5 rad are the viscous friction's (above), the rest a step of friction where a joint stops; the ball bounces on
    apart = np.abs(compiled - held)
    assert apart[:, :7].max() < 1e-4, "measured: 5e-5 rad"
    assert apart[:, 7:].max() < 2e-4, "measured: 1.2e-4 m, over bounces and a slide along the wall"


def test_dart_looks_before_anything_touches() -> None:
    """A ball that falls onto cup, handle and links from many places meets none of them unseen."""
    game = kendama_game()
    world = ArmWorld(bench_arm(), game, links=True)
    world.reset(world.arm.home_rad)
    home, still = world.arm.home_rad, np.zeros(7)
    positions = world.arm.joint_positions_m(home)
    world.perturb(WorldErrors(rope_scale=5.0))  # long enough for every place
    rng, touched = np.random.default_rng(2), 0
    for _ in range(60):
        looked = watched(world)
        world.reset(home)
        a, b = positions[(k := rng.integers(1, len(positions) - 1))], positions[k + 1]
        target = world.ball.tie_m + np.array([0, 0, 0.05]) if rng.random() < 0.4 else a + rng.random() * (b - a)
        path = rng.normal(size=3)
        path *= 0.35 / np.linalg.norm(path)
        world.ball.put((target + path).tolist(), (-path / 0.35 * rng.uniform(1.0, 12.0)).tolist())
        for step in range(150):
            world.step(home, still, still)
            contacts = world._dart.getLastCollisionResult().getNumContacts()
            if contacts and looked[-1]:
                assert step == 0 or looked[-2], "something touched in the first step in which DART looked"
                touched += 1
                break
        del world._control.follow
    assert touched > 25
