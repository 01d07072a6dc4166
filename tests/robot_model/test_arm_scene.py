"""Drawing of an arm stands at the arm's pose, in every posture."""

from __future__ import annotations

import dataclasses
import struct
from pathlib import Path

import numpy as np
import pytest

from kendama_cli.motion.rotation import matrix_of
from kendama_cli.robot_model.arm_scene import ArmScene, cup_solid, read_stl, thinned
from kendama_cli.robot_model.model import RobotModel
from kendama_cli.schema.foxglove import SceneUpdate, Solid
from kendama_cli.schema.messages import codec
from tests.simulation.dart.bench_robot import bench_arm, kendama_game

GAME = kendama_game()


@pytest.fixture(scope="module")
def arm() -> RobotModel:
    return RobotModel(bench_arm(), GAME.cup, GAME.gravity_m_s2)


@pytest.mark.parametrize("seed", [10000, 10001])
def test_the_spheres_at_the_links_ends_stand_on_the_joints_in_any_posture(arm: RobotModel, seed: int) -> None:
    scene = ArmScene(arm)
    solids = scene.shapes(GAME).solids
    position = np.random.default_rng(seed).uniform(arm.limits.lower_rad, arm.limits.upper_rad).clip(-3, 3)
    frames = scene.frames(position)
    rows = zip(frames.children, frames.positions_m, frames.rotations_wxyz, strict=True)
    pose = {name: (at, matrix_of(rotation)) for name, at, rotation in rows}
    ends = [
        pose[one.frame][0] + pose[one.frame][1] @ np.array(one.position_m)
        for one in solids
        if one.kind == "sphere" and one.name == "link"
    ]
    positions = arm.joint_positions_m(position)
    distance = np.linalg.norm(np.array(ends)[:, None] - positions[None], axis=2)
    assert distance.min(axis=1).max() < 1e-9  # every sphere on a joint
    assert distance.min(axis=0).max() < 1e-9  # and every joint has one


def test_the_handle_ends_at_the_cups_wall(arm: RobotModel) -> None:
    scene = ArmScene(arm)
    solids = scene.shapes(GAME).solids
    frames = scene.frames(arm.home_rad)
    handle = [one for one in solids if one.name == "handle" and one.kind == "sphere"][-1]
    k = list(frames.children).index(handle.frame)
    end = frames.positions_m[k] + matrix_of(frames.rotations_wxyz[k]) @ np.array(handle.position_m)
    assert np.linalg.norm(end - arm.tool_position_m(arm.home_rad)) == pytest.approx(GAME.cup.outer_radius_m, abs=1e-9)


def test_the_cup_is_a_closed_surface_as_wide_and_high_as_the_cup() -> None:
    cup = cup_solid(GAME.cup)
    vertices, triangles = np.array(cup.vertices_m), np.array(cup.triangles)
    across = 2 * GAME.cup.outer_radius_m
    np.testing.assert_allclose(np.ptp(vertices, axis=0), [across, across, GAME.cup.depth_m], rtol=1e-9)
    _, same = np.unique(vertices.round(9), axis=0, return_inverse=True)  # the poles are many vertices at one place
    corners = same.reshape(-1)[triangles]
    corners = corners[(corners != np.roll(corners, 1, axis=1)).all(axis=1)]
    edges = np.sort(np.concatenate([corners[:, [0, 1]], corners[:, [1, 2]], corners[:, [2, 0]]]), axis=1)
    assert (np.unique(edges, axis=0, return_counts=True)[1] == 2).all()


def test_the_scene_comes_back_from_its_protobuf(arm: RobotModel) -> None:
    scene = ArmScene(arm).shapes(GAME)
    made = codec(SceneUpdate)
    read = made.decode(made.encode(scene, 5))
    for one, other in zip(read.solids, scene.solids, strict=True):
        assert (one.frame, one.name, one.kind) == (other.frame, other.name, other.kind)
        for field in ("rgb", "position_m", "rotation_wxyz", "vertices_m", "triangles"):
            np.testing.assert_allclose(getattr(one, field), np.array(list(getattr(other, field))), atol=1e-12)
        if one.kind != "mesh":
            np.testing.assert_allclose(one.size_m, other.size_m, atol=1e-12)


def _stl(triangles: np.ndarray) -> bytes:
    rows = b"".join(struct.pack("<12fH", *np.zeros(3), *corners.ravel(), 0) for corners in triangles)
    return bytes(80) + struct.pack("<I", len(triangles)) + rows


def test_a_binary_stl_is_read_and_anything_else_is_not(tmp_path: Path) -> None:
    corners = np.array([[[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 0], [1, 0, 0], [1, 1, 0]]], dtype=float)
    (tmp_path / "two.stl").write_bytes(_stl(corners))
    vertices, triangles = read_stl(tmp_path / "two.stl")
    assert len(vertices) == 4
    np.testing.assert_array_equal(vertices[triangles], corners)
    (tmp_path / "cut.stl").write_bytes(_stl(corners)[:-10])
    (tmp_path / "words.stl").write_text("solid one\nendsolid\n")
    for name in ("cut.stl", "words.stl", "absent.stl"):
        assert read_stl(tmp_path / name) is None


def test_a_thinned_mesh_keeps_its_extent_within_a_cell() -> None:
    n = 40
    u, v = np.meshgrid(np.linspace(0, np.pi, n), np.linspace(0, 2 * np.pi, n), indexing="ij")
    vertices = np.stack([np.sin(u) * np.cos(v), np.sin(u) * np.sin(v), np.cos(u)], axis=-1).reshape(-1, 3)
    a = (np.arange(n - 1)[:, None] * n + np.arange(n - 1)).ravel()
    triangles = np.concatenate([np.column_stack([a, a + 1, a + n]), np.column_stack([a + 1, a + n + 1, a + n])])
    few, corners = thinned(vertices, triangles, 400)
    assert len(corners) <= 400
    assert corners.max() < len(few)
    assert np.abs(np.linalg.norm(few, axis=1) - 1).max() < 0.12  # cells of 2 / 9 m at the coarsest that is needed
    assert thinned(vertices, triangles, 10**6)[1] is triangles


BOX = '<collision><origin xyz="0 0 0.1"/><geometry><box size="0.1 0.2 0.3"/></geometry></collision>'


def _links(folder: Path, *shapes: str) -> list[Solid]:
    """What is drawn of the PA10 whose first link has ``shapes``."""
    text = Path(bench_arm().path).read_text(encoding="utf-8")
    first = text.index("</link>")
    (folder / "arm.urdf").write_text(text[:first] + "".join(shapes) + text[first:], encoding="utf-8")
    settings = dataclasses.replace(bench_arm(), path=str(folder / "arm.urdf"))
    solids = ArmScene(RobotModel(settings, GAME.cup, 9.81)).shapes(GAME).solids
    return [one for one in solids if one.name == "link"]


def test_a_description_with_shapes_is_drawn_by_them(tmp_path: Path) -> None:
    (link,) = _links(tmp_path, BOX)
    assert link.kind == "box"
    assert tuple(link.size_m) == (0.1, 0.2, 0.3)


@pytest.mark.parametrize(
    "shape",
    [
        '<collision><geometry><mesh filename="package://elsewhere/arm.dae"/></geometry></collision>',
        BOX.replace("0 0 0.1", "0 0 up"),
        "<collision><geometry/></collision>",
    ],
)
def test_a_description_with_a_shape_that_cannot_be_read_is_drawn_as_capsules(tmp_path: Path, shape: str) -> None:
    assert {link.kind for link in _links(tmp_path, BOX, shape)} == {"cylinder", "sphere"}
