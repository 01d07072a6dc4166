"""The compiled dynamics beside Lagrange's equations of random chains, and its constants beside DART's arm."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest

from kendama_cli.robot_model.chain_kernel import Chain
from kendama_cli.settings.game import SideTie
from kendama_cli.simulation.dart.dynamics_kernel import ArmArrays, carry_rotors, move_chain
from tests.robot_model.random_chain import bias, inertia, jacobian, poses, random_chain
from tests.simulation.dart.bench_robot import bench_arm, kendama_game, modelled

EXACT = {"rel": 1e-7, "abs": 1e-7}
"""Size of the differences by which the referee finds the inertia's change."""


def _links(chain: Chain) -> np.ndarray:
    columns = chain.axes, chain.origins, chain.centers_m, chain.inertia_kg_m2.reshape(-1, 9)
    return np.hstack([*columns, chain.mass_kg[:, None], chain.rotor_kg_m2[:, None]])


@pytest.mark.parametrize("seed", range(6))
def test_a_random_chain_moves_by_lagrange_s_equations_and_its_points_as_their_links(seed: int) -> None:
    rng = np.random.default_rng(seed)
    chain, n = random_chain(rng), 4
    angles, speeds, changes = rng.normal(0, [[2.0], [1.5], [5.0]], (3, n))
    marks, force = rng.normal(size=(3, 3)), rng.normal(size=n)
    found, rest, screws = np.empty((n, n)), np.empty(n), np.empty((n, 6))
    points, mark_speeds = np.empty((n + 3, 3)), np.empty((3, 3))
    move_chain(angles, speeds, _links(chain), marks, chain.gravity_m_s2, found, rest, screws, points, mark_speeds)
    assert found == pytest.approx(inertia(chain, angles) + np.diag(chain.rotor_kg_m2), **EXACT)
    assert rest == pytest.approx(bias(chain, angles, speeds), **EXACT)
    at = poses(chain, angles)
    origins = [rotation @ origin + shift for (rotation, shift), origin in zip(at, chain.origins, strict=False)]
    assert points == pytest.approx(np.vstack([origins, marks @ at[n][0].T + at[n][1]]), abs=1e-12)
    moved = [jacobian(chain, angles, mark, n)[0] @ speeds for mark in marks]
    assert mark_speeds == pytest.approx(np.array(moved), abs=1e-12)
    axes = jacobian(chain, angles, marks[0], n)[1].T
    assert screws == pytest.approx(np.hstack([axes, np.cross(origins, axes)]), abs=1e-12)

    # links of nothing but the inertia of their rotors about their axes: what DART's links carry
    carried = np.einsum("i,ij,ik->ijk", chain.rotor_kg_m2, chain.axes, chain.axes)
    bare = chain._replace(mass_kg=np.zeros(n), inertia_kg_m2=carried)
    torque = inertia(bare, angles) @ changes + bias(bare, angles, speeds)
    expected = force + torque - chain.rotor_kg_m2 * changes
    carry_rotors(screws, speeds, changes, chain.rotor_kg_m2, force)
    assert force == pytest.approx(expected, **EXACT)


@pytest.mark.parametrize("cup", ["floor", "side"])
def test_marks_and_radii_are_those_of_the_placed_arm_its_handle_and_its_cup(cup: str) -> None:
    robot = dataclasses.replace(bench_arm(), base_heading_rad=0.7, base_position_m=(0.1, -0.2, 0.3))
    game = kendama_game()
    if cup == "side":
        game = dataclasses.replace(game, cup=dataclasses.replace(game.cup, tie=SideTie("side", 0.02, 50.0)))
    arm = modelled(robot)
    body, compiled = arm.new_body(), ArmArrays(arm, game, links=True)
    angles = np.random.default_rng(1).uniform(-1.5, 1.5, 7)
    body.skeleton.setPositions(angles)
    compiled.move(angles, np.zeros(7))
    tie_m, rotation = body.tie.getCOM(), body.cup.getWorldTransform().rotation()
    height = game.cup.rim_m
    expected = [tie_m + height / 2 * rotation[:, 2], tie_m, tie_m + rotation[:, 2]]
    if cup == "side":
        out = np.exp(1j * math.radians(50.0)) * game.cup.outer_radius_m
        expected.append(tie_m + rotation @ [out.real, out.imag, height - 0.02])
    assert compiled.points[7] == pytest.approx(arm.joint_positions_m(angles)[-1], abs=1e-12)
    assert compiled.points[8:] == pytest.approx(np.array(expected), abs=1e-12)
    ball = game.ball.radius_m
    radii = compiled.radii - ball
    # the widest of the cup is a corner between two staves, at the rim or at the bottom, seen from half its height
    corner = complex(1.0, math.tan(math.pi / game.cup.staves)) * game.cup.outer_radius_m
    assert radii[-1] == pytest.approx(math.hypot(abs(corner), height / 2))
    assert radii[:-2] == pytest.approx(arm.link_radius_m)
    assert radii[-2] == pytest.approx(0.015 + height / 2), "the handle is 30 mm wide, and ends beside the cup's middle"
    assert (ArmArrays(arm, game, links=False).radii[:-1] == -math.inf).all()
