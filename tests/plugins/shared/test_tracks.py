"""Files of markers and bodies as other programs write them, beside readings of the test's own or of another library."""

import contextlib
from itertools import permutations, product

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from kendama_cli.errors import InputError
from kendama_cli.plugins.shared.recordings.reader import read_bodies, read_tracks
from tests.devices.demonstrator.files import swing, write

T, P = swing()
BALL = P - [0.0, 0.0, 0.4]
TURNS = Rotation.from_rotvec(np.sin(np.pi * T / T[-1])[:, None] ** 2 * [0.3, -0.5, 0.2])


def trc_lines(unit="m", mark="\t", *, gap=True, tail="", missing=(), comma=False):
    scale = {"m": 1.0, "mm": 1000.0}[unit]
    keys = "DataRate CameraRate NumFrames NumMarkers Units OrigDataRate OrigDataStartFrame OrigNumFrames"
    names = "Frame#,Time,cup,,,ball,," if mark == "\t" else "Frame#,Time,cup,ball"
    head = [
        *(
            mark.join(line.split())
            for line in ("PathFileType 4 (X/Y/Z) a.trc", keys, f"100 100 201 2 {unit} 100 1 201")
        ),
        *(mark.join(line.split(",")) for line in (names, ",,X1,Y1,Z1,X2,Y2,Z2")),
        *([""] if gap else []),
    ]
    rows = []
    for i, (t, cup, ball) in enumerate(zip(T, scale * P, scale * BALL, strict=True)):
        seen = [f"{value:.6f}" for value in (*cup, *ball)]
        cells = [str(i + 1), f"{t:.5f}", *(["", "", ""] if i in missing else seen[:3]), *seen[3:]]
        rows.append(mark.join(cells).replace(".", "," if comma else ".") + tail)
    return [*head, *rows]


@pytest.mark.parametrize(
    "given",
    [
        {}, {"unit": "mm"}, {"gap": False}, {"tail": "\t"}, {"mark": " "}, {"comma": True},
        {"missing": (20, 21)},
    ],
    ids=str,
)  # fmt: skip
@pytest.mark.parametrize("end", ["\n", "\r\n"])
def test_a_trc_is_read_with_its_markers(tmp_path, given, end):
    (tmp_path / "a.trc").write_bytes((end.join(trc_lines(**given)) + end).encode())
    cup, ball = read_bodies(str(tmp_path / "a.trc"))
    assert (cup.name, ball.name) == ("cup", "ball")
    assert cup.t_s == pytest.approx(T, abs=1e-9)
    truth = P.copy()
    truth[list(given.get("missing", ()))] = np.nan
    assert cup.position_m == pytest.approx(truth, abs=1e-6, nan_ok=True)
    assert ball.position_m == pytest.approx(BALL, abs=1e-6)
    assert [one.name for one in read_tracks(tmp_path / "a.trc")] == ["cup", "ball"]


def test_a_trc_without_a_unit_is_refused(tmp_path):
    with pytest.raises(InputError, match=r"2 names, 201 data rows, in the unit 'furlong'"):
        read_bodies(str(write(tmp_path / "a.trc", [line.replace("\tm\t", "\tfurlong\t") for line in trc_lines()])))


def about(axis, angle_rad):
    """The matrix of a turn about x, y or z, by hand."""
    i = "XYZ".index(axis)
    j, k = (i + 1) % 3, (i + 2) % 3
    made = np.eye(3)
    made[j, j] = made[k, k] = np.cos(angle_rad)
    made[j, k], made[k, j] = -np.sin(angle_rad), np.sin(angle_rad)
    return made


def motive_lines(kind, columns, rows, *, newer=False, unit="Meters"):
    wide = len(columns) + 3
    labels = ("Type", "Name", "ID", "Parent") if newer else ("", "", "")
    head = [
        f"Format Version,1.23,Take Name,t,Rotation Type,{kind},Length Units,{unit},Coordinate Space,Global", "",
        *(f",{label}" + f",{cell}" * wide for label, cell in zip(labels, ("Body", "cup", "id", ""), strict=False)),
        ",," + ",".join(["Rotation"] * len(columns) + ["Position"] * 3),
        "Frame,Time (Seconds)," + ",".join([*columns, *"XYZ"]),
    ]  # fmt: skip
    return [*head, *(",".join([str(i), *row]) for i, row in enumerate(rows))]


@pytest.mark.parametrize("newer", [False, True])
@pytest.mark.parametrize("order", ["".join(order) for order in permutations("XYZ")])
def test_euler_angles_of_motive_are_about_the_bodys_own_axes(tmp_path, order, newer):
    """R = R1(a) R2(b) R3(c) for the order 123, multiplied out by hand; columns are named X, Y, Z whatever the order."""
    angles = np.column_stack([0.4 * np.sin(T), 0.3 * np.cos(2 * T), 0.2 * T])  # about X, Y and Z
    rows = [
        [f"{t:.6f}", *(f"{np.degrees(a):.9f}" for a in angle), *(f"{v:.6f}" for v in p)]
        for t, angle, p in zip(T, angles, P, strict=True)
    ]
    rows[5][1:] = [""] * 6
    (cup,) = read_bodies(str(write(tmp_path / "a.csv", motive_lines(order, "XYZ", rows, newer=newer))))
    assert cup.name == "cup"
    assert np.isnan(cup.rotation_wxyz[5]).all()
    assert np.isnan(cup.position_m[5]).all()
    for i in (0, 50, 200):
        truth = np.eye(3)
        for axis in order:
            truth = truth @ about(axis, angles[i, "XYZ".index(axis)])
        made = Rotation.from_quat(cup.rotation_wxyz[i], scalar_first=True).as_matrix()
        assert made == pytest.approx(truth, abs=1e-9)


def test_a_rotation_of_motive_that_is_neither_is_named(tmp_path):
    rows = [[f"{t:.6f}", "0", "0", "0", "0", "0", "0"] for t in T]
    with pytest.raises(InputError, match="rotations are of the type 'Axis Angle' in the columns X, Y, Z"):
        read_bodies(str(write(tmp_path / "a.csv", motive_lines("Axis Angle", "XYZ", rows))))


def test_motive_in_millimetres_and_utf_16_is_read(tmp_path):
    q = TURNS.as_quat()
    rows = [
        [f"{t:.6f}", *(f"{v:.9f}" for v in a), *(f"{1e3 * v:.5f}" for v in p)] for t, a, p in zip(T, q, P, strict=True)
    ]
    text = "\r\n".join(motive_lines("Quaternion", "XYZW", rows, unit="Millimeters"))
    (tmp_path / "a.csv").write_bytes(text.encode("utf-16"))
    (cup,) = read_bodies(str(tmp_path / "a.csv"))
    assert cup.position_m == pytest.approx(P, abs=1e-7)
    assert (Rotation.from_quat(cup.rotation_wxyz, scalar_first=True).inv() * TURNS).magnitude().max() < 1e-7


def test_trajectories_of_vicon_are_read(tmp_path):
    rows = [
        ",".join([str(i + 1), "0", *(f"{1e3 * v:.4f}" for v in (*cup, *ball))])
        for i, (cup, ball) in enumerate(zip(P, BALL, strict=True))
    ]
    head = [
        "Trajectories",
        "100",
        ",,kendama:cup,,,kendama:ball,,",
        "Frame,Sub Frame,X,Y,Z,X,Y,Z",
        ",,mm,mm,mm,mm,mm,mm",
    ]
    cup, ball = read_bodies(str(write(tmp_path / "a.csv", [*head, *rows, "", "Devices", "1000", "1,2"])))
    assert (cup.name, ball.name) == ("cup", "ball")
    assert cup.t_s == pytest.approx(T, abs=1e-9)
    assert cup.position_m == pytest.approx(P, abs=1e-7)
    with pytest.raises(InputError, match="no 'Trajectories' with a rate and data below"):
        read_bodies(str(write(tmp_path / "b.csv", ["Devices", "1000", ",,a", "Frame,Sub Frame,Fx", ",,N", "1,0,2"])))


@pytest.mark.parametrize(("count", "unit"), [(3, "mm  "), (3, "m\0\0\0"), (300, "mm"), (600, "mm ")])
def test_a_c3d_of_many_points_and_padded_units_is_read_as_ezc3d_reads_it(tmp_path, count, unit):
    ezc3d = pytest.importorskip("ezc3d")
    scale = 1e3 if unit.startswith("mm") else 1.0
    made = ezc3d.c3d()
    made["parameters"]["POINT"]["RATE"]["value"] = [100.0]
    made["parameters"]["POINT"]["UNITS"]["value"] = [unit]
    names = [f"p{i:03d}" for i in range(count)]
    for number, first in enumerate(range(0, count, 255), start=1):
        label = "LABELS" if number == 1 else f"LABELS{number}"
        made.add_parameter("POINT", label, names[first : first + 255])
    points = np.ones((4, count, len(T)))
    points[:3] = scale * (P.T[:, None] + 0.01 * np.arange(count)[None, :, None])
    made["data"]["points"] = points
    made.write(str(tmp_path / "a.c3d"))
    theirs = ezc3d.c3d(str(tmp_path / "a.c3d"))
    tracks = read_bodies(str(tmp_path / "a.c3d"))
    assert [one.name for one in tracks] == names
    for i in (0, count // 2, count - 1):
        assert tracks[i].position_m == pytest.approx(theirs["data"]["points"][:3, i].T / scale, abs=1e-9)
        assert tracks[i].position_m == pytest.approx(P + 0.01 * i, abs=1e-5)


@pytest.mark.parametrize("comma", [False, True])
@pytest.mark.parametrize("turned", [False, True])
def test_a_plain_table_may_hold_orientation_and_commas(tmp_path, comma, turned):
    values = np.column_stack([T, P, TURNS.as_quat(scalar_first=True)])[:, : 8 if turned else 4]
    names = ["t_s", "x_m", "y_m", "z_m", "qw", "qx", "qy", "qz"][: values.shape[1]]
    lines = [";".join(names), *(";".join(f"{value:.9f}" for value in row) for row in values)]
    (cup,) = read_bodies(str(write(tmp_path / "a.csv", [line.replace(".", ",") if comma else line for line in lines])))
    assert cup.position_m == pytest.approx(P, abs=1e-8)
    assert (cup.rotation_wxyz is not None) == turned


def test_every_flip_of_a_bit_is_reported_or_harmless(tmp_path):
    """No traceback for a damaged file of any kind of text, whichever bit is wrong."""
    head = ["Trajectories", "100", ",,a:cup,,", "Frame,Sub Frame,X,Y,Z", ",,mm,mm,mm", "1,0,1,2,3", "2,0,1,2,3"]
    motive = motive_lines("XYZ", "XYZ", [["0.0", "1", "2", "3", "4", "5", "6"], ["0.1", "1", "2", "3", "4", "5", "6"]])
    for lines, bit in product((trc_lines()[:9], head, motive), range(0, 3000, 7)):
        content = bytearray("\n".join(lines).encode())
        if bit // 8 < len(content):
            content[bit // 8] ^= 1 << bit % 8
            (tmp_path / "a.csv").write_bytes(content)
            with contextlib.suppress(InputError):
                read_bodies(str(tmp_path / "a.csv"))
