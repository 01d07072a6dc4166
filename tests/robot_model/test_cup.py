"""The cup's parts where its settings say, and its inertia as that of a thin tube."""

from __future__ import annotations

import math

import numpy as np
import pytest

from kendama_cli.robot_model.cup import attach_cup, frame_along
from kendama_cli.robot_model.dart_library import dartpy
from kendama_cli.schema.settings import build
from kendama_cli.settings.game import CupSettings
from tests.shipped_conf import plain


@pytest.mark.parametrize("name", ["floor", "handle"])
def test_staves_close_to_a_ring_about_a_floor_and_weigh_as_a_thin_tube(name: str) -> None:
    cup = build(CupSettings, plain("game/cup", name), "cup")
    skeleton = dartpy.dynamics.Skeleton("held")
    _, holder = skeleton.createWeldJointAndBodyNodePair()
    body, tie = attach_cup(skeleton, holder, dartpy.math.Isometry3(), cup)
    nodes = [(node.getShape(), node.getRelativeTransform()) for node in body.getShapeNodes()]
    staves, rounds = nodes[: cup.staves], nodes[cup.staves :]
    corners = []
    for shape, pose in staves:
        deep, wide, high = shape.getSize()
        rotation, center = pose.rotation(), pose.translation()
        inner = center - rotation[:, 0] * deep / 2
        assert np.hypot(*inner[:2]) == pytest.approx(cup.radius_m)
        assert rotation @ rotation.T == pytest.approx(np.eye(3))
        assert abs(np.cross(rotation[:, 0], inner / np.linalg.norm(inner[:2]))[2]) < 1e-9, "it faces the axis"
        assert (center[2] - high / 2, center[2] + high / 2) == pytest.approx((cup.floor_m, cup.rim_m))
        outer = center + rotation[:, 0] * deep / 2
        assert np.hypot(*outer[:2]) == pytest.approx(cup.outer_radius_m)
        corners += [(outer + side * rotation[:, 1] * wide / 2)[:2] for side in (-1, 1)]
    # the left corner of each stave is the right one of the next
    assert np.roll(corners[1::2], 1, axis=0) == pytest.approx(np.array(corners[::2]), abs=1e-9)
    parts = [(shape.getRadius(), shape.getHeight(), *pose.translation()) for shape, pose in rounds]
    expected = [(cup.radius_m, cup.wall_m, 0.0, 0.0, cup.floor_m + cup.wall_m / 2)]
    if name == "handle":
        expected.append((cup.tie.radius_m, cup.floor_m, 0.0, 0.0, cup.floor_m / 2))
    assert np.array(parts) == pytest.approx(np.array(expected))
    turn, height = np.meshgrid(np.arange(64) * math.pi / 32, (np.arange(400) + 0.5) / 400 * cup.depth_m + cup.floor_m)
    points = np.column_stack([cup.radius_m * np.cos(turn.ravel()), cup.radius_m * np.sin(turn.ravel()), height.ravel()])
    away = points - points.mean(axis=0)
    moment = (away**2).sum() * np.eye(3) - away.T @ away
    own = body.getInertia()
    assert own.getLocalCOM() == pytest.approx(points.mean(axis=0), abs=1e-9)
    assert own.getMoment() == pytest.approx(cup.mass_kg * moment / len(points), rel=1e-4, abs=1e-12)
    assert own.getMass() == cup.mass_kg
    assert tie.getInertia().getMass() < 1e-5
    assert tie.getInertia().getMoment().trace() < 1e-9


def test_a_frame_along_an_axis_is_a_rotation_with_that_as_its_z() -> None:
    for z in np.random.default_rng(1).normal(size=(20, 3)):
        found = frame_along(z / np.linalg.norm(z))
        assert found @ found.T == pytest.approx(np.eye(3), abs=1e-12)
        assert np.linalg.det(found) == pytest.approx(1.0)
        assert found[:, 2] == pytest.approx(z / np.linalg.norm(z))
