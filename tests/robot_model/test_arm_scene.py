"""Drawing of an arm stands at the arm's pose, in every posture."""

from __future__ import annotations

import dataclasses
import struct
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from kendama_cli.motion.rotation import matrix_of
from kendama_cli.robot_model.arm_scene import ArmScene, cup_solid, read_stl, thinned
from kendama_cli.robot_model.chain import compiled_chain
from kendama_cli.robot_model.model import RobotModel
from kendama_cli.schema.foxglove import SceneUpdate, Solid
from kendama_cli.schema.messages import codec
from kendama_cli.schema.settings import build
from kendama_cli.settings.game import CupSettings
from tests.shipped_conf import plain
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


@pytest.mark.parametrize("name", ["floor", "handle"])
def test_the_cup_s_solid_holds_the_volume_of_its_wall_floor_and_handle(name: str) -> None:
    """Volumes by the divergence theorem, with the area of a polygon of 40 corners."""
    cup = build(CupSettings, plain("game/cup", name), "cup")
    solid = cup_solid(cup)
    corners = np.array(solid.vertices_m)[np.array(solid.triangles)]
    area = 20 * np.sin(np.pi / 20)
    volume = area * cup.outer_radius_m**2 * (cup.rim_m - cup.floor_m)
    volume -= area * cup.radius_m**2 * (cup.rim_m - cup.floor_m - cup.wall_m)
    volume += area * getattr(cup.tie, "radius_m", 0.0) ** 2 * cup.floor_m
    assert np.linalg.det(corners).sum() / 6 == pytest.approx(volume)


def test_capsules_end_on_their_spheres_hubs_lie_along_the_axes_and_the_pedestal_stands_on_the_floor(
    arm: RobotModel,
) -> None:
    scene = ArmScene(arm)
    frames = scene.frames(arm.home_rad)
    rows = zip(frames.children, frames.positions_m, frames.rotations_wxyz, strict=True)
    pose = {name: (at, matrix_of(rotation)) for name, at, rotation in rows}
    chain, found = compiled_chain(arm), {}
    body = arm.new_body()
    body.skeleton.setPositions(arm.home_rad)
    for one in scene.shapes(GAME).solids:
        if one.kind in ("cylinder", "sphere") and one.frame in pose:
            at, turn = pose[one.frame]
            center, axis = at + turn @ one.position_m, turn @ matrix_of(np.array(one.rotation_wxyz))[:, 2]
            found.setdefault((one.name, one.kind), []).append((center, axis, *one.size_m[1:], one.frame))
    spheres = {name: np.array([one[0] for one in found[name, "sphere"]]) for name in ("link", "base", "handle")}
    widths = {frame: width for _, _, width, _, frame in found["link", "sphere"]}
    for name, places in spheres.items():
        for center, axis, width, length, frame in found[name, "cylinder"]:
            for end in (center - axis * length / 2, center + axis * length / 2):
                assert np.linalg.norm(places - end, axis=1).min() < 1e-9
            assert width == pytest.approx({"handle": 0.03}.get(name, widths.get(frame, width)))
    assert list(widths.values()) == pytest.approx(2 * arm.link_radius_m)
    assert 1.0 < found["base", "sphere"][0][2] / (2 * arm.link_radius_m[0]) < 1.5
    hubs = found["joint", "cylinder"]
    for hub, origin, joint, radius in zip(
        hubs, arm.joint_positions_m(arm.home_rad), body.joints, arm.link_radius_m, strict=False
    ):
        frame = joint.getChildBodyNode().getWorldTransform().multiply(joint.getTransformFromChildBodyNode())
        assert hub[0] == pytest.approx(origin, abs=1e-9)
        assert abs(hub[1] @ frame.rotation() @ joint.getAxis()) == pytest.approx(1.0)
        assert 0.7 * radius < hub[2] / 2 < radius < hub[3] / 2 < 1.5 * radius
    assert len(hubs) == len(chain.axes)
    (stand, flange), root = found["pedestal", "cylinder"], arm.settings.base_position_m
    assert stand[0] == pytest.approx([*root[:2], root[2] / 2])
    assert (stand[3], flange[3]) == pytest.approx((root[2], 0.02))
    assert flange[0] == pytest.approx([*root[:2], 0.01])
    assert arm.link_radius_m.max() < stand[2] / 2 < flange[2] / 2 < 2.5 * arm.link_radius_m.max()
    low = dataclasses.replace(arm.settings, base_position_m=(0.0, 0.0, 0.01))
    names = [one.name for one in ArmScene(RobotModel(low, GAME.cup, 9.81)).shapes(GAME).solids]
    assert "pedestal" not in names


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


def test_shapes_have_the_sizes_and_poses_of_the_description(tmp_path: Path) -> None:
    corners = np.array([[[0, 0, 0], [1, 0, 0], [0, 1, 0]]], dtype=float)
    (tmp_path / "one.stl").write_bytes(_stl(corners))
    kinds = {
        "cylinder": '<cylinder radius="0.2" length="0.5"/>',
        "sphere": '<sphere radius="0.3"/>',
        "mesh": '<mesh filename="one.stl" scale="2 3 4"/>',
    }
    origin = '<collision><origin xyz="0.1 -0.2 0.3" rpy="0.3 -0.4 0.5"/><geometry>'
    shapes = [f"{origin}{kind}</geometry></collision>" for kind in kinds.values()]
    packed = f'<mesh filename="package://{tmp_path.name}/one.stl"/>'
    shapes.append(f"<collision><geometry>{packed}</geometry></collision>")  # without an origin, and named by a package
    rod, ball, mesh, bare = _links(tmp_path, *shapes)
    assert np.array(bare.vertices_m)[np.array(bare.triangles)[0]] == pytest.approx(corners[0])
    assert (*bare.position_m, *bare.rotation_wxyz) == pytest.approx((0, 0, 0, 1, 0, 0, 0))
    assert [one.kind for one in (rod, ball, mesh)] == list(kinds)
    assert (tuple(rod.size_m), tuple(ball.size_m)) == ((0.4, 0.4, 0.5), (0.6, 0.6, 0.6))
    vertices = np.array(mesh.vertices_m)[np.array(mesh.triangles)[0]]
    assert vertices == pytest.approx(corners[0] * [2, 3, 4])
    for one in (rod, ball, mesh):
        assert one.position_m == pytest.approx([0.1, -0.2, 0.3])
        turn = Rotation.from_euler("xyz", [0.3, -0.4, 0.5]).as_matrix()
        assert matrix_of(np.array(one.rotation_wxyz)) == pytest.approx(turn)


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
