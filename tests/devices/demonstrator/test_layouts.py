"""Text as other programs and spreadsheets write it gives the same swing, or is refused with its true reason."""

import datetime

import numpy as np
import pytest

from tests.devices.demonstrator.files import csv_lines, file_settings, read, swing, write
from tests.devices.demonstrator.test_bad_input import refusal

T, P = swing()
START = datetime.datetime(2024, 3, 30, 23, 59, 59, tzinfo=datetime.UTC)


def same(read_back, atol=1e-6):
    t_s, position_m = read_back
    return np.allclose(t_s, T, atol=1e-6) and np.allclose(position_m, P, atol=atol)


def cells(time=lambda i, t: f"{t:.3f}"):
    """The swing's rows as cells, times as ``time`` writes them."""
    return [[time(i, t), *(f"{value:.6f}" for value in p)] for i, (t, p) in enumerate(zip(T, P, strict=True))]


def joined(rows, mark=",", comma=False, end=""):
    lines = [mark.join(row) + end for row in rows]
    return [line.replace(".", ",") for line in lines] if comma else lines


HEAD = "t_s,x_m,y_m,z_m"


@pytest.mark.parametrize(
    "lines",
    [
        [HEAD.replace(",", ";"), *joined(cells(), ";", comma=True)],
        [HEAD.replace(",", "\t"), *joined(cells(), "\t", comma=True)],
        [HEAD.replace(",", " "), *joined(cells(), " ", comma=True)],
        [HEAD, *joined([[f'"{cell.replace(".", ",")}"' for cell in row] for row in cells()])],
        [HEAD.replace(",", ";"), *joined(cells(lambda i, t: f"{t:.3E}"), ";", comma=True)],
        [HEAD.replace(",", ";") + ";", *joined(cells(), ";", comma=True, end=";")],
        [HEAD, *(line.replace("-", "\N{MINUS SIGN}") for line in joined(cells()))],
    ],
    ids=["semicolons", "tabs", "blanks", "quoted", "exponents", "trailing", "minus sign"],
)
def test_decimals_may_be_written_with_commas(tmp_path, lines):
    assert same(read(write(tmp_path / "a.csv", lines)))


@pytest.mark.parametrize(
    "head",
    [
        [HEAD, "s,m,m,m"],
        [HEAD, "(s),[m],[m],[m]"],
        [HEAD, "seconds,meters,meters,meters", ""],
        ["# " + HEAD],
        ["# made by numpy", "#" + HEAD],
        ["Take 1", "rate,100", "", HEAD, ""],
        ["Trajectories", "100", HEAD],
        ['"t_s" , "x_m" , "y_m" , "z_m"'],
    ],
)
def test_names_are_found_above_units_comments_and_empty_lines(tmp_path, head):
    assert same(read(write(tmp_path / "a.csv", [*head, *joined(cells())])))


@pytest.mark.parametrize(
    ("units", "key", "told"),
    [("s,mm,mm,mm", "unit", "mm"), ("ms,m,m,m", "time_unit", "ms"), ("s,cm,cm,cm", "unit", "cm")],
)
def test_a_row_of_units_that_says_another_is_refused_with_the_setting(tmp_path, units, key, told):
    scale, faster = {"mm": 1e3, "cm": 1e2}.get(told, 1.0), 1e3 if told == "ms" else 1.0
    rows = [[f"{value:.9f}" for value in row] for row in np.column_stack([faster * T, scale * P])]
    file = write(tmp_path / "a.csv", [HEAD, units, *joined(rows)])
    message = refusal(file)
    assert f"line 2: the row of units says '{told}'" in message
    assert f"set capture.{key}={told}" in message
    assert same(read(file, **{key: told}))


@pytest.mark.parametrize("end", ["\n", "\r\n", "\r", "\r\r\n", "\n\n"])
def test_lines_may_end_as_any_system_ends_them(tmp_path, end):
    (tmp_path / "a.csv").write_bytes(end.join([HEAD, *joined(cells())]).encode())
    assert same(read(tmp_path / "a.csv"))


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16", "cp1252"])
@pytest.mark.parametrize("end", ["\n", "\r\n"])
def test_any_encoding_of_a_spreadsheet_is_read(tmp_path, encoding, end):
    names = "Zeit;Höhe;quer;vorwärts"
    lines = [names, *joined([[t, z, y, x] for t, x, y, z in cells()], ";", comma=True)]
    (tmp_path / "a.csv").write_bytes((end.join(lines) + end).encode(encoding))
    assert same(read(tmp_path / "a.csv", columns={"time": "Zeit", "x": "vorwärts", "y": "quer", "z": "Höhe"}))


def stamp(form):
    """Writes the time of a sample, which begins a second before midnight."""

    def time(_, t):
        return form(START + datetime.timedelta(milliseconds=round(1e3 * t)))

    return time


@pytest.mark.parametrize(
    "form",
    [
        lambda d: d.isoformat(timespec="milliseconds"),
        lambda d: d.isoformat(timespec="milliseconds").replace("+00:00", "Z"),
        lambda d: d.astimezone(datetime.timezone(datetime.timedelta(hours=2))).isoformat(" ", "microseconds"),
        lambda d: d.strftime("%Y-%m-%dT%H:%M:%S,") + f"{d.microsecond // 1000:03d}",
        lambda d: d.strftime("%Y-%m-%d %H:%M:%S.") + f"{d.microsecond // 1000:03d}000000",
        lambda d: d.strftime("%H:%M:%S.") + f"{d.microsecond // 1000:03d}",
        lambda d: d.strftime("%d.%m.%Y %H:%M:%S,") + f"{d.microsecond // 1000:03d}",
        lambda d: d.strftime("%m/%d/%Y %H:%M:%S.") + f"{d.microsecond // 1000:03d}",
        lambda d: f"{int(d.timestamp())}{d.microsecond // 1000:03d}e-3",
    ],
)
def test_times_may_be_dates_and_clocks(tmp_path, form):
    lines = [HEAD.replace(",", ";"), *joined(cells(stamp(form)), ";")]
    assert same(read(write(tmp_path / "a.csv", lines)))


def test_nanoseconds_since_1970_lose_nothing(tmp_path):
    lines = [HEAD, *joined(cells(lambda i, _: str(1_711_843_199_000_000_001 + 10_000_000 * i)))]
    t_s, _ = read(write(tmp_path / "a.csv", lines), time_unit="ns")
    assert np.abs(t_s - T).max() < 1e-12


def test_a_date_that_is_none_is_reported(tmp_path):
    rows = cells(stamp(lambda d: d.isoformat()))
    rows[7][0] = "2024-13-45T00:00:00"
    assert "line 2, column t_s: '2024-03-30T23:59:59" in refusal(write(tmp_path / "a.csv", [HEAD, *joined(rows)]))


def test_a_file_of_another_kind_is_called_by_its_name(tmp_path):
    (tmp_path / "a.c3d").write_bytes(b"\x02\x50" + bytes(510))
    assert "is a C3D, whose bodies capture=body reads; type: kendama capture layout" in refusal(tmp_path / "a.c3d")
    trc = write(tmp_path / "a.trc", ["PathFileType\t4\t(X/Y/Z)\ta.trc", "DataRate\tUnits", "100\tm", *csv_lines()[1:]])
    assert "it is a TRC, which capture=body reads" in refusal(trc)


def test_a_project_with_settings_from_before_handedness_works(tmp_path):
    settings = file_settings(tmp_path / "a.csv")
    assert settings.handedness == "right"
