"""The ball's forces in one step and at rest, by hand."""

from __future__ import annotations

import dataclasses
import itertools
import math

import numpy as np
import pytest

from kendama_cli.settings.game import LinearAir, SideTie
from kendama_cli.simulation.dart.arm_errors import WorldErrors
from kendama_cli.simulation.dart.rope_kernel import RUBS_FULLY_M_S
from kendama_cli.simulation.dart.step_kernel import BEFORE, GIVEN, LAST, PRESSED, press
from kendama_cli.simulation.dart.world import STEP_S, ArmWorld
from tests.simulation.dart.bench_robot import bench_arm, kendama_game

GAME = dataclasses.replace(kendama_game(), air=LinearAir("linear", 0.0))
G = GAME.gravity_m_s2
STILL = np.zeros(7)


def _world(errors: WorldErrors, game: object = GAME) -> ArmWorld:
    world = ArmWorld(bench_arm(), game)  # type: ignore[arg-type]
    world.perturb(errors)
    world.reset(world.arm.home_rad)
    return world


def test_what_a_ball_presses_with_is_what_its_forces_do_not_explain_the_smaller_of_two_steps() -> None:
    touch, weight, numbers = np.zeros(13), np.array([0.0, 0.0, -0.5]), np.array([0.05, 10.0, 0.0, 0.0, 0.0, 0.0])
    press(np.ones(3), numbers, STEP_S, touch)
    assert not touch.any(), "nothing is known of the step before"
    given, before = np.array([0.1, 0.0, 0.2]), np.array([1.0, 0.0, -2.0])
    told = []
    for after in ([1.0, 0.0, -2.0], [1.0, 0.0, -1.9], [1.002, 0.0, -2.006], [1.002, 0.0, -2.006]):
        touch[BEFORE:GIVEN], touch[GIVEN:LAST], touch[PRESSED] = before, given, 1.0
        press(np.array(after), numbers, STEP_S, touch)
        told.append((given + weight - 0.05 * (np.array(after) - before) / STEP_S, touch[:3].copy()))
    assert told[1][1] == pytest.approx(told[0][0]), "an impact does not count"
    assert told[2][1] == pytest.approx(told[2][0])
    assert told[3][1] == pytest.approx(told[3][0])


def test_a_free_ball_falls_along_a_gravity_that_leans_by_both_angles_with_all_of_its_size() -> None:
    for tilt_x, tilt_y in ((0.0, 0.0), (0.1, 0.0), (0.0, -0.2), (0.15, 0.1)):
        world = _world(WorldErrors(gravity_tilt_rad=tilt_x, gravity_tilt_y_rad=tilt_y, mass_scale=1.3))
        world.ball.put((world.ball.tie_m + np.array([0.1, 0.05, -0.2])).tolist(), [0.5, -0.2, 0.1])
        world.step(world.arm.home_rad, STILL, STILL)
        fall = (world.ball.velocity_m_s - [0.5, -0.2, 0.1]) / STEP_S
        expected = [math.sin(tilt_x), math.cos(tilt_x) * math.sin(tilt_y), -math.cos(tilt_x) * math.cos(tilt_y)]
        assert fall == pytest.approx(G * np.array(expected), abs=1e-9)
        assert world.ball.mass_kg == pytest.approx(1.3 * GAME.ball.mass_kg)


@pytest.mark.parametrize("tie", [None, SideTie("side", 0.02, 50.0)])
def test_a_ball_hangs_on_a_rope_that_its_weight_stretches_and_stays(tie: SideTie | None) -> None:
    """It starts beside that place by what is asked; without that nothing moves but the arm, by micrometres."""
    game = GAME if tie is None else dataclasses.replace(GAME, cup=dataclasses.replace(GAME.cup, tie=tie))
    cup, knot = game.cup, np.zeros(3)
    if tie is not None:
        turn = math.radians(50.0)
        knot = np.array([cup.outer_radius_m * math.cos(turn), cup.outer_radius_m * math.sin(turn), cup.rim_m - 0.02])
    for start in (0.0, 0.1):
        errors = WorldErrors(rope_scale=1.1, mass_scale=2.0, ball_start_m=start, ball_start_y_m=start / 2)
        world = _world(errors, game)
        ball, length = world.ball, 1.1 * game.rope.length_m + 2 * GAME.ball.mass_kg * G / game.rope.stiffness_n_m
        pose = world.body.cup.getWorldTransform()
        way = ball.position_m - (pose.translation() + pose.rotation() @ knot)
        assert way == pytest.approx([start, start / 2, -math.sqrt(length**2 - 1.25 * start**2)], abs=1e-9)
        assert ball.rope_m == pytest.approx(1.1 * game.rope.length_m)
        assert ball.tension_n == pytest.approx(2 * GAME.ball.mass_kg * G)
        tension = ball.tension_n
        assert ball.pulled[:7] == pytest.approx([0.0, 0.0, tension, tension, 0.0, 0.0, -tension])
        assert not ball.velocity_m_s.any()
    if tie is None:
        world = _world(WorldErrors())
        hung = world.ball.position_m
        for _ in range(100):
            world.step(world.arm.home_rad, STILL, STILL)
        assert np.abs(world.ball.position_m - hung).max() < 1e-4


def test_friction_at_the_tie_brakes_across_the_rope_by_its_tension_and_radius_over_the_length() -> None:
    plain, rubbed = (_world(WorldErrors(tie_friction_m=radius)) for radius in (0.0, 0.003))
    for world in (plain, rubbed):
        world.ball.put((world.ball.tie_m + np.array([0.1, 0.0, -0.3905])).tolist(), [1.0, 0.4, 0.3])
        world.step(world.arm.home_rad, STILL, STILL)
    along = np.array([0.1, 0.0, -0.3905])
    along /= np.linalg.norm(along)
    across = np.array([1.0, 0.4, 0.3]) - np.dot([1.0, 0.4, 0.3], along) * along
    size = np.linalg.norm(across)
    force = -0.003 * plain.ball.tension_n / GAME.rope.length_m * across / (size + RUBS_FULLY_M_S)
    found = (rubbed.ball.velocity_m_s - plain.ball.velocity_m_s) * GAME.ball.mass_kg / STEP_S
    assert plain.ball.tension_n > 1.0
    assert found == pytest.approx(force, rel=1e-6, abs=1e-9)


def test_a_ball_at_rest_in_the_cup_presses_with_its_weight_and_is_in_it() -> None:
    world = ArmWorld(bench_arm(), GAME)
    world.ball.put((world.ball.tie_m + np.array([0.0, 0.0, 0.03])).tolist(), [0.0, 0.0, 0.0])
    for _ in range(600):
        world.step(world.arm.home_rad, STILL, STILL)
    assert world.ball.touch[:3] == pytest.approx([0.0, 0.0, -GAME.ball.mass_kg * G], abs=1e-3)
    assert world.ball.is_in_cup()
    assert world.ball.axis == pytest.approx([0.0, 0.0, 1.0], abs=1e-3)
    inertia = world.ball.skeleton.getBodyNode(0).getInertia().getMoment()
    assert inertia == pytest.approx(0.4 * GAME.ball.mass_kg * GAME.ball.radius_m**2 * np.eye(3), rel=1e-9, abs=1e-15)


def test_links_are_capsules_from_joint_to_joint_and_the_handle_ends_before_the_cup_s_wall() -> None:
    world = ArmWorld(bench_arm(), GAME, links=True)
    arm, body = world.arm, world.body
    body.skeleton.setPositions(arm.home_rad)
    found = []
    for number in range(body.skeleton.getNumBodyNodes()):
        link = body.skeleton.getBodyNode(number)
        for node in link.getShapeNodes():
            if node.getShape().getType() == "CapsuleShape":
                pose, shape = node.getWorldTransform(), node.getShape()
                half = pose.rotation()[:, 2] * shape.getHeight() / 2
                found.append((shape.getRadius(), pose.translation() - half, pose.translation() + half))
    positions, radii = arm.joint_positions_m(arm.home_rad), [*arm.link_radius_m, 0.015]
    tie = arm.tool_position_m(arm.home_rad)
    way = tie - positions[-1]
    short = np.linalg.norm(way) - GAME.cup.outer_radius_m - 0.015
    ends = [
        *itertools.pairwise(positions),
        (positions[-1], positions[-1] + way / np.linalg.norm(way) * short),
    ]
    expected = [
        (radius, *pair) for radius, pair in zip(radii, ends, strict=True) if np.linalg.norm(pair[1] - pair[0]) > 1e-3
    ]
    assert len(found) == len(expected)
    for one, other in zip(
        sorted(found, key=lambda row: row[1][2]), sorted(expected, key=lambda row: row[1][2]), strict=True
    ):
        assert one[0] == pytest.approx(other[0])
        assert np.array(one[1:]) == pytest.approx(np.array(other[1:]), abs=1e-9)
