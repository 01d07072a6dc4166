"""Maps of positions map rotations too: by matrices of the test's own."""

import dataclasses
from itertools import permutations, product

import numpy as np
import pytest
import yaml
from scipy.spatial.transform import Rotation

from kendama_cli.devices.demonstrator.file import open_files
from kendama_cli.devices.demonstrator.interface import open_demonstrators
from kendama_cli.errors import ConfigError, InputError
from kendama_cli.plugins.mocap.settings import MocapCapture
from kendama_cli.schema.settings import build
from tests.devices.demonstrator.files import CONF, file_settings, swing, write
from tests.plugins.mocap.test_body import motive, settings

T, P = swing()
TURNS = Rotation.from_rotvec(np.sin(np.pi * T / T[-1])[:, None] ** 2 * [0.3, -0.5, 0.2])


def matrix_of(order, signs):
    """Rows: which axis of the file is our x, y and z."""
    return np.array(signs)[:, None] * np.eye(3)[list(order)]


def written(path, matrix, names="xyz"):
    """A file in the frame from which ``matrix`` leads to ours, right-handed or not."""
    place, turn = P @ matrix, matrix.T @ TURNS.as_matrix() @ matrix
    quaternions = Rotation.from_matrix(turn).as_quat(scalar_first=True)
    head = ",".join(["t", *(f"p{name}" for name in names), "qw", *(f"q{name}" for name in names)])
    rows = [",".join(f"{value:.9f}" for value in row) for row in np.column_stack([T, place, quaternions])]
    return write(path, [head, *rows])


def declared(path, order, signs, handedness, numbers=False):
    axes = ["xyz"[i] for i in order]
    columns = dict(zip("xyz", [2 + i for i in order] if numbers else [f"p{axis}" for axis in axes], strict=True))
    turns = dict(zip("xyz", [6 + i for i in order] if numbers else [f"q{axis}" for axis in axes], strict=True))
    return file_settings(
        path,
        columns={"time": 1, **columns},
        rotation={"w": 5, **turns} if numbers else {"w": "qw", **turns},
        sign=dict(zip("xyz", signs, strict=True)),
        handedness=handedness,
        plausible={"axes": "off"},
    )


@pytest.mark.parametrize("numbers", [False, True])
@pytest.mark.parametrize("order", list(permutations(range(3))))
@pytest.mark.parametrize("signs", list(product((1, -1), repeat=3)))
def test_any_axes_and_signs_turn_the_cup_as_they_move_it(tmp_path, order, signs, numbers):
    matrix = matrix_of(order, signs)
    path = written(tmp_path / "a.csv", matrix)
    mirrors = np.linalg.det(matrix) < 0
    (hand,) = open_files(declared(path, order, signs, "left" if mirrors else "right", numbers))
    samples = list(hand.samples())
    assert np.array([one.position_m for one in samples]) == pytest.approx(P, abs=1e-8)
    made = Rotation.from_quat([one.rotation_wxyz for one in samples], scalar_first=True)
    assert (made.inv() * TURNS).magnitude().max() < 1e-7
    with pytest.raises(InputError, match="mirrors the space" if mirrors else "leaves left-handed axes left-handed"):
        open_files(declared(path, order, signs, "right" if mirrors else "left", numbers))


def test_places_alone_are_taken_however_they_are_mirrored(tmp_path):
    path = written(tmp_path / "a.csv", np.diag([-1.0, 1.0, 1.0]))
    mirrored = declared(path, (0, 1, 2), (-1, 1, 1), "right")
    none = dataclasses.replace(mirrored.rotation, w=None, x=None, y=None, z=None)
    (hand,) = open_files(dataclasses.replace(mirrored, rotation=none))
    assert np.array([one.position_m for one in hand.samples()]) == pytest.approx(P, abs=1e-8)


def test_places_and_turns_in_another_order_are_refused(tmp_path):
    path = written(tmp_path / "a.csv", np.eye(3))
    mixed = declared(path, (1, 0, 2), (1, 1, 1), "right")
    straight = declared(path, (0, 1, 2), (1, 1, 1), "right").rotation
    with pytest.raises(InputError, match="take x, y and z in another order \\(py, px, pz; qx, qy, qz\\)"):
        open_files(dataclasses.replace(mixed, rotation=straight))


MIRRORED = {"axes": ["x", "z", "y"], "plausible": {"axes": "off"}}


def test_a_body_of_a_left_handed_tracker_is_mirrored_whole(tmp_path):
    """Its y points up, its z ahead: as Unity's. The cup is 0.1 m along the body's x."""
    left = matrix_of((0, 2, 1), (1, 1, 1))
    turned = TURNS.as_matrix()
    body_m = P - turned @ [0.1, 0.0, 0.0]
    path = motive(tmp_path / "a.csv", T, P, TURNS)
    lines = path.read_text().splitlines()[:7]
    quaternions = Rotation.from_matrix(left.T @ turned @ left).as_quat()
    for i, (t, p, q) in enumerate(zip(T, body_m @ left, quaternions, strict=True)):
        lines.append(",".join([str(i), f"{t:.6f}", *(f"{value:.8f}" for value in (*q, *p)), "", "", ""]))
    write(path, lines)
    given = {**MIRRORED, "body": "cup", "body_to_cup_m": [0.1, 0.0, 0.0], "upright": "given"}
    (hand,) = open_demonstrators(settings(path, **given, handedness="left"))
    samples = list(hand.samples())
    assert np.array([one.position_m for one in samples]) == pytest.approx(P, abs=1e-6)
    made = Rotation.from_quat([one.rotation_wxyz for one in samples], scalar_first=True)
    assert (made.inv() * TURNS).magnitude().max() < 1e-6
    with pytest.raises(InputError, match=r"capture\.axes is \['x', 'z', 'y'\], which mirrors the space"):
        open_demonstrators(settings(path, **given))


def test_a_marker_without_orientation_may_be_mirrored(tmp_path):
    path = write(tmp_path / "a.csv", ["t_s,x_m,y_m,z_m", *(f"{t:.3f},{x:.6f},{z:.6f},{y:.6f}" for t, (x, y, z) in
                                                           zip(T, P, strict=True))])  # fmt: skip
    (hand,) = open_demonstrators(settings(path, **MIRRORED))
    assert np.array([one.position_m for one in hand.samples()]) == pytest.approx(P, abs=1e-6)


def test_a_live_stream_is_refused_before_anybody_swings():
    data = yaml.safe_load((CONF / "mocap.yaml").read_text())
    with pytest.raises(ConfigError, match=r"'capture\.axes' is \['x', 'z', 'y'\], which mirrors the space"):
        build(MocapCapture, data | {"axes": ["x", "z", "y"]}, "capture")
    assert build(MocapCapture, data | {"axes": ["x", "z", "y"], "handedness": "left"}, "capture")
    with pytest.raises(ConfigError, match="each of x, y and z once"):
        build(MocapCapture, data | {"axes": ["x", "x", "y"]}, "capture")
