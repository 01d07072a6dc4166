"""The robot as meshes: what they look like, and which are refused."""

import dataclasses

import numpy as np
import pytest

from kendama_cli.devices.camera.virtual import VirtualCameraBlock
from kendama_cli.errors import ConfigError
from kendama_cli.motion.rotation import exp_of
from kendama_cli.rendering import tiles, tracer
from kendama_cli.rendering.mesh import LinkMesh, unit_cylinder
from kendama_cli.vision.cameras.region import Region, around
from tests.devices.camera.test_virtual import Clock, camera, light_of, posed, still
from tests.vision.scenes import game, lighting, shipped_models, virtual


def test_a_mesh_of_many_triangles_looks_like_the_rod_that_it_approximates():
    vertices, triangles = unit_cylinder(400)
    lengthwise = np.array([0.1, 0.1, 0.5])
    mesh = LinkMesh(vertices * lengthwise, triangles, virtual().appearance.arm_rgb)
    turn = np.array([[1.0, 0, 0], [0, 0, 1], [0, -1, 0]]).T  # the mesh's z along -y of the world
    pose = np.column_stack([turn, [0.1, 0.4, 0.2]])
    ends = np.array([[0.1, 0.4, 0.2], [0.1, 0.4, 0.2] + 0.5 * turn[:, 2]])
    thick = dataclasses.replace(virtual(), appearance=dataclasses.replace(virtual().appearance, arm_radius_m=0.1))
    meshed, rods = (
        VirtualCameraBlock(shipped_models()[0], thick, game(), lighting("side"), scene=None, clock=Clock(),
                           rng=np.random.default_rng(0), links=links) for links in ([mesh], [])
    )  # fmt: skip
    nothing = posed([0, -30, 0])
    flank = around(meshed.model.project((ends[0] + ends[1]) / 2)[0] + (100, 0), 30)
    shown = light_of(meshed, lambda _: dataclasses.replace(nothing, links=pose[None]), flank)
    expected = light_of(rods, lambda _: dataclasses.replace(nothing, arm_m=ends), flank)
    assert np.median(np.abs(shown - expected)) < 0.01
    assert np.ptp(expected) > 0.05


def test_rays_that_are_not_traced_would_have_changed_nothing(monkeypatch):
    """All tiles are asked for all meshes, and all rays that meet a mesh's bounds: the image is the same."""
    vertices, triangles = unit_cylinder(12)
    rng = np.random.default_rng(10000)
    meshes = [LinkMesh(vertices * size, triangles, (0.5, 0.5, 0.5)) for size in rng.uniform(0.05, 0.3, (6, 3))]
    turns = [exp_of(turn) for turn in rng.normal(0, 1, (6, 3))]
    places = rng.uniform((-0.4, -0.1, -0.4), (0.4, 0.5, 0.2), (6, 3))

    def scene(t_s):  # they turn and move by about two pixels
        links = np.array([np.column_stack([turn, p + 3.0 * t_s]) for turn, p in zip(turns, places, strict=True)])
        return dataclasses.replace(posed([0.1, -0.2, 0.1]), links=links)

    made = VirtualCameraBlock(
        shipped_models()[0], virtual(), game(), lighting("side"), scene=scene, clock=Clock(),
        rng=np.random.default_rng(0), links=meshes,
    )  # fmt: skip
    everything = Region(0, 0, made.model.width_px, made.model.height_px)
    shown = light_of(made, scene, everything)
    assert np.ptp(shown) > 0.3
    for module in (tiles, tracer):
        monkeypatch.setattr(module, "bundles_meeting", lambda part, starts, ways, *_: np.ones(len(ways), dtype=bool))
    monkeypatch.setattr(tracer, "_nearest_first", lambda parts, origin: reversed(list(enumerate(parts))))
    np.testing.assert_array_equal(light_of(made, scene, everything), shown)


def test_links_without_their_meshes_are_refused_in_one_line():
    pose = dataclasses.replace(posed([0, 0, 0.3]), links=np.zeros((2, 3, 4)))
    with pytest.raises(
        ConfigError, match=r"poses of 2 links, but the camera was given 0 meshes: give both in the same"
    ):
        light_of(camera(still([0, 0, 0]), Clock()), lambda _: pose, Region(0, 0, 8, 8))


@pytest.mark.parametrize(
    ("vertices", "triangles", "message"),
    [
        (np.zeros((3, 2)), [[0, 1, 2]], r"needs finite vertices \(n, 3\), not \(3, 2\)"),
        (np.full((3, 3), np.nan), [[0, 1, 2]], "needs finite vertices"),
        (np.zeros((3, 3)), np.empty((0, 3), dtype=int), r"needs triangles \(m, 3\) with m > 0"),
        (np.zeros((3, 3)), [[0, 1, 3]], "a mesh of 3 vertices has triangles that name vertex 3"),
    ],
)
def test_a_mesh_that_cannot_be_is_refused(vertices, triangles, message):
    with pytest.raises(ValueError, match=message):
        LinkMesh(vertices, np.asarray(triangles), (0.1, 0.1, 0.1))
