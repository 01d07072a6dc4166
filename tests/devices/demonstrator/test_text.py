"""Text files with every declared layout give the same swing."""

import numpy as np
import pytest

from kendama_cli.devices.demonstrator.file import open_files
from kendama_cli.errors import ConfigError, InputError
from tests.devices.demonstrator.files import csv_lines, file_settings, read, swing, write

T, P = swing()
BY_NUMBER = {"time": 1, "x": 2, "y": 3, "z": 4}


def same(read_back, atol=1e-6):
    t_s, position_m = read_back
    return np.allclose(t_s, T, atol=1e-9) and np.allclose(position_m, P, atol=atol)


def test_csv_with_a_header(tmp_path):
    assert same(read(write(tmp_path / "a.csv", csv_lines())))


@pytest.mark.parametrize(("name", "mark"), [("tab", "\t"), ("semicolon", ";"), ("pipe", "|"), ("whitespace", "   ")])
@pytest.mark.parametrize("declared", [True, False])
def test_other_delimiters_declared_and_found(tmp_path, name, mark, declared):
    file = write(tmp_path / "a.txt", [line.replace(",", mark) for line in csv_lines()])
    assert same(read(file, delimiter=name if declared else "auto"))


@pytest.mark.parametrize(("unit", "scale"), [("m", 1.0), ("cm", 1e2), ("mm", 1e3)])
def test_units(tmp_path, unit, scale):
    assert same(read(write(tmp_path / "a.csv", csv_lines(scale)), unit=unit))


@pytest.mark.parametrize(("unit", "factor"), [("ms", 1e3), ("us", 1e6), ("ns", 1e9)])
def test_time_units(tmp_path, unit, factor):
    lines = csv_lines()
    rows = [f"{round(float(line.split(',')[0]) * factor)},{line.split(',', 1)[1]}" for line in lines[1:]]
    assert same(read(write(tmp_path / "a.csv", [lines[0], *rows]), time_unit=unit))


def test_epoch_time_stamps_start_at_zero(tmp_path):
    lines = csv_lines()
    rows = [f"{1.7e9 + float(line.split(',')[0]):.3f},{line.split(',', 1)[1]}" for line in lines[1:]]
    t_s, _ = read(write(tmp_path / "a.csv", [lines[0], *rows]))
    assert t_s[0] == 0
    assert np.allclose(t_s, T, atol=1e-6)


@pytest.mark.parametrize("base", [0, 1])
def test_columns_by_number_from_zero_or_one(tmp_path, base):
    file = write(tmp_path / "a.csv", csv_lines()[1:])
    columns = {axis: number - 1 + base for axis, number in BY_NUMBER.items()}
    assert same(read(file, columns=columns, column_base=base))


def test_signs_and_swapped_axes(tmp_path):
    file = write(tmp_path / "a.csv", csv_lines())
    _, position_m = read(file, columns={"x": "z_m", "z": "x_m"}, sign={"x": -1, "z": -1})
    assert np.allclose(position_m, np.column_stack((-P[:, 2], P[:, 1], -P[:, 0])), atol=1e-6)


def test_without_y_the_swing_stays_in_its_plane(tmp_path):
    _, position_m = read(write(tmp_path / "a.csv", csv_lines()), columns={"y": None})
    assert not position_m[:, 1].any()


def test_without_time_column_the_rate_gives_the_time(tmp_path):
    assert same(read(write(tmp_path / "a.csv", csv_lines()), columns={"time": None}, rate_hz=100.0))


def test_row_range_counts_data_rows_from_one(tmp_path):
    _, position_m = read(write(tmp_path / "a.csv", csv_lines()), first_row=11, last_row=150)
    assert len(position_m) == 140
    assert np.allclose(position_m, P[10:150], atol=1e-6)


def test_comments_bom_crlf_quotes_and_trailing_blank_lines(tmp_path):
    lines = ["# made by hand", *csv_lines()[:50], "# a remark", *csv_lines()[50:], "", ""]
    lines[1] = '"t_s","x_m","y_m","z_m"'
    file = tmp_path / "a.csv"
    file.write_bytes(b"\xef\xbb\xbf" + "\r\n".join(lines).encode())
    assert same(read(file))


def test_numbers_in_quotes_as_spreadsheets_write_them(tmp_path):
    quoted = [",".join(f'"{cell}"' for cell in line.split(",")) for line in csv_lines()]
    assert same(read(write(tmp_path / "a.csv", quoted)))


def test_several_header_rows_are_found_as_motion_capture_writes_them(tmp_path):
    lines = ["NO_OF_FRAMES,201", "FREQUENCY,100", "", "MARKERS,a,b", *csv_lines()]
    assert same(read(write(tmp_path / "a.csv", lines)))


def test_declared_header_rows(tmp_path):
    lines = ["1,2,3,4", "5,6,7,8", *csv_lines()]
    assert same(read(write(tmp_path / "a.csv", lines), header_rows=3))


@pytest.mark.recording
def test_the_iiwa_recording_is_read_by_its_ready_node(recordings):
    t_s, position_m = read(recordings / "li-kendama" / "kendama1-20.txt", "iiwa_kendama")
    assert len(t_s) == 350
    assert t_s[-1] == pytest.approx(3.49)
    assert position_m[0] == pytest.approx([0.022253, 0, 0.371043])
    assert np.ptp(position_m, axis=0) == pytest.approx([0.3043, 0, 0.2765], abs=1e-3)


@pytest.mark.recording
def test_a_qualisys_file_is_read_by_column_numbers(recordings):
    """A marker of the juggling robot, 300 Hz, mm, tab-separated under 12 header rows."""
    file = recordings / "jugglebot" / "6_throws_minimal_tracking_loss.tsv"
    columns = {"time": 2, "x": 12, "y": 13, "z": 14}
    plausible = {"min_extent_m": 1e-6, "min_peak_speed_m_s": 1e-6}
    t_s, position_m = read(file, columns=columns, unit="mm", last_row=300, plausible=plausible)
    assert len(t_s) == 300
    assert position_m[0] == pytest.approx([0.249083, -0.181895, 0.030998])


@pytest.mark.recording
def test_a_motive_file_is_read_by_column_numbers(recordings):
    """A stick of a person who plays diabolo, 120 Hz, metres, y up, under Motive's seven header rows."""
    file = recordings / "diabolo" / "z_hop_1.csv"
    t_s, position_m = read(file, columns={"time": 2, "x": 7, "y": 9, "z": 8}, sign={"y": -1})
    assert t_s[1] == pytest.approx(1 / 120, abs=1e-4)
    assert position_m[0] == pytest.approx([-0.150353, -0.738103, 0.436091])


@pytest.mark.parametrize(
    ("changes", "key", "message"),
    [
        ({"columns": {"time": None}}, "capture.rate_hz", "give it or columns.time, one of the two; both are null"),
        ({"rate_hz": 100.0}, "capture.rate_hz", "both are set"),
        ({"columns": {"x": None}}, "capture.columns.x", "must be a column number or name, not null"),
        ({"columns": {"x": 0}}, "capture.columns.x", "allowed: at least 1"),
        ({"first_row": 9, "last_row": 3}, "capture.last_row", "allowed: at least first_row (9), or null"),
        ({"unit": "km"}, "capture.unit", "Allowed: m, cm, mm, in"),
    ],
)
def test_a_wrong_declaration_names_its_key(changes, key, message):
    with pytest.raises(ConfigError) as caught:
        file_settings("a.csv", **changes)
    assert caught.value.key == key
    assert message in str(caught.value)
    assert f"'{key}'" in str(caught.value)


def test_the_ready_node_asks_for_its_path():
    with pytest.raises(ConfigError, match=r"'capture.path' names no recording; set it to a file"):
        file_settings("", "iiwa_kendama")


def test_quaternions_rotate_the_cup_from_where_it_begins(tmp_path):
    t, p = swing()
    angle = 0.4 * np.sin(np.pi * t / t[-1]) + 0.1
    q = np.column_stack((np.cos(angle / 2), 0 * t, np.sin(angle / 2), 0 * t))
    rows = [",".join(f"{v:.7f}" for v in (a, *b, *c)) for a, b, c in zip(t, p, q, strict=True)]
    file = write(tmp_path / "a.csv", ["t_s,x_m,y_m,z_m,qw,qx,qy,qz", *rows])
    named = {"w": "qw", "x": "qx", "y": "qy", "z": "qz"}
    (hand,) = open_files(file_settings(file, rotation=named))
    made = np.array([sample.rotation_wxyz for sample in hand.samples()])
    assert 2 * np.arcsin(made[:, 2]) == pytest.approx(angle - 0.1, abs=1e-6)
    (hand,) = open_files(file_settings(file, rotation={**named, "upright": "given"}))
    made = np.array([sample.rotation_wxyz for sample in hand.samples()])
    assert 2 * np.arcsin(made[:, 2]) == pytest.approx(angle, abs=1e-6)
    with pytest.raises(InputError, match=r"line 2: a quaternion of length 0\.\d+; it must be 1; look at capture\.rot"):
        open_files(file_settings(file, rotation={**named, "w": "x_m"}))
