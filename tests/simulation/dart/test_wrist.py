from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest

from kendama_cli.settings.game import LinearAir
from kendama_cli.simulation.dart.world import STEP_S, ArmWorld
from tests.simulation.dart.bench_robot import bench_arm, frictionless_bench_arm, kendama_game

STILL = np.zeros(7)


def in_world(world: ArmWorld) -> tuple[np.ndarray, np.ndarray]:
    """The wrench with its force and torque turned into the world's axes."""
    rotation = world.body.tip.getWorldTransform().rotation()
    wrench = world.wrist_wrench()
    return rotation @ wrench[:3], rotation @ wrench[3:]


def hold(world: ArmWorld, steps: int) -> None:
    for _ in range(steps):
        world.step(world.arm.home_rad, STILL, STILL)


def test_at_rest_the_wrist_feels_the_weight_of_cup_and_ball() -> None:
    game = kendama_game()
    world = ArmWorld(bench_arm(), game)
    for steps in (0, 1, 1000):
        hold(world, steps)
        force, torque = in_world(world)
        weight = np.array([0.0, 0.0, -(game.cup.mass_kg + game.ball.mass_kg) * game.gravity_m_s2])
        assert force == pytest.approx(weight, abs=1e-3)
        arm = np.array(world.ball.tie_m) - world.body.tip.getWorldTransform().translation()
        assert torque == pytest.approx(np.cross(arm, weight), abs=1e-3)


def test_a_ball_that_lies_in_the_cup_weighs_as_much_as_one_that_hangs() -> None:
    game = kendama_game()
    world = ArmWorld(bench_arm(), game)
    x, y, z = world.ball.tie_m
    world.ball.put([x, y, z + 0.03], [0.0, 0.0, 0.0])
    hold(world, 1500)
    assert world.ball.tension_n == 0.0
    force, _ = in_world(world)
    assert force[2] == pytest.approx(-(game.cup.mass_kg + game.ball.mass_kg) * game.gravity_m_s2, abs=1e-3)


def test_a_free_ball_weighs_nothing_at_the_wrist() -> None:
    game = kendama_game()
    world = ArmWorld(bench_arm(), game)
    x, y, z = world.ball.tie_m
    world.ball.put([x + 0.1, y, z], [0.0, 0.0, 0.0])
    hold(world, 50)
    assert world.ball.tension_n == 0.0
    force, _ = in_world(world)
    assert force[2] == pytest.approx(-game.cup.mass_kg * game.gravity_m_s2, abs=5e-3)


def test_a_swinging_ball_pulls_with_its_centripetal_force() -> None:
    """Let go at the horizontal, a ball passes the bottom with m v^2 / l = 2 m g, so that the rope bears 3 m g."""
    game = kendama_game()
    bare = dataclasses.replace(game, air=LinearAir("linear", 0.0))
    world = ArmWorld(bench_arm(), bare)
    x, y, z = world.ball.tie_m
    length = bare.rope.length_m
    world.ball.put([x + length, y, z], [0.0, 0.0, 0.0])
    weight, tool = bare.ball.mass_kg * bare.gravity_m_s2, bare.cup.mass_kg * bare.gravity_m_s2
    seen = []
    for _ in range(600):
        hold(world, 1)
        bx, _, bz = (b - t for b, t in zip(world.ball.position_m, world.ball.tie_m, strict=True))
        force, _ = in_world(world)
        seen.append((math.atan2(bx, -bz), math.hypot(force[0], force[2] + tool)))
    angle, tension = min(seen, key=lambda one: abs(one[0]))
    assert abs(angle) < 0.01
    # the rope's stretch of 3 m g / Ks = 0.7 mm and its damped oscillation are what is left
    assert tension == pytest.approx(3 * weight, rel=0.03)


def test_an_accelerated_cup_is_felt_as_mass_times_acceleration() -> None:
    game = dataclasses.replace(kendama_game(), gravity_m_s2=1e-9)
    world = ArmWorld(frictionless_bench_arm(), game)
    world.ball.put(
        [world.ball.tie_m[0], world.ball.tie_m[1], world.ball.tie_m[2] - 0.2], [0.0, 0.0, 0.0]
    )  # a slack rope
    home = world.arm.home_rad
    for k in range(1, 301):
        t = k * STEP_S
        before = np.array(world.ball.tie_m_s)
        wave = np.array([1.0, -0.4, 0.3, 0.2, 0.1, 0.5, 0.3])
        world.step(
            home + wave * 0.05 * (1 - math.cos(9 * t)), wave * 0.45 * math.sin(9 * t), wave * 4.05 * math.cos(9 * t)
        )
    cup = world.body.cup
    center = np.array(cup.getCOMLinearAcceleration())
    force, _ = in_world(world)
    assert world.ball.tension_n == 0.0
    assert force == pytest.approx(-game.cup.mass_kg * center, abs=1e-3)
    assert np.linalg.norm(before) > 0.05


def test_reading_the_wrist_changes_nothing() -> None:
    read, unread = ArmWorld(bench_arm(), kendama_game()), ArmWorld(bench_arm(), kendama_game())
    for k in range(1, 400):
        t = k * STEP_S
        for world in (read, unread):
            world.step(
                world.arm.home_rad + 0.05 * (1 - math.cos(6 * t)),
                np.full(7, 0.3 * math.sin(6 * t)),
                np.full(7, 1.8 * math.cos(6 * t)),
            )
        read.wrist_wrench()
    assert (read.position_rad == unread.position_rad).all()
    assert (read.ball.position_m == unread.ball.position_m).all()
