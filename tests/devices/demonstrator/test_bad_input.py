"""Each kind of bad recording gets one line: the file, the row, the value, the remedy."""

import numpy as np
import pytest

from kendama_cli.devices.demonstrator.file import open_files
from kendama_cli.errors import InputError
from tests.devices.demonstrator.files import csv_lines, file_settings, read, write


def refusal(path, name="file", **changes):
    with pytest.raises(InputError) as caught:
        read(path, name, **changes)
    message = str(caught.value)
    assert message.startswith(str(path))
    assert "\n" not in message
    assert caught.value.remedy
    assert caught.value.exit_code == 2
    return message


def edited(tmp_path, line, text):
    """The CSV with the 1-based ``line`` replaced by ``text`` (None: left out)."""
    lines = csv_lines()
    lines[line - 1 : line] = [] if text is None else [text]
    return write(tmp_path / "a.csv", lines)


@pytest.mark.parametrize(("scale", "extent"), [(1e3, "230.9 m"), (1e-3, "0.00023 m"), (10.0, "2.309 m")])
def test_wrong_units_are_reported_by_the_extent(tmp_path, scale, extent):
    message = refusal(write(tmp_path / "a.csv", csv_lines(scale)))
    assert f"the swing extends over {extent}" in message
    assert "a hand's swing takes 0.05 to 2 m" in message
    assert "capture.unit" in message


def test_millimetres_declared_for_metres_are_reported_too(tmp_path):
    assert "extends over 0.0002309 m" in refusal(write(tmp_path / "a.csv", csv_lines()), unit="mm")


def test_a_wrong_rate_is_reported_by_the_speed(tmp_path):
    file = write(tmp_path / "a.csv", csv_lines())
    message = refusal(file, columns={"time": None}, rate_hz=5000.0)
    assert "the peak speed is" in message
    assert "capture.rate_hz" in message
    assert "a hand's swing reaches 0.1 to 8 m/s" in refusal(file, columns={"time": None}, rate_hz=1.0)


def test_milliseconds_read_as_seconds_are_reported_by_the_speed(tmp_path):
    lines = csv_lines()
    rows = [f"{round(float(line.split(',')[0]) * 1000)},{line.split(',', 1)[1]}" for line in lines[1:]]
    assert "capture.time_unit" in refusal(write(tmp_path / "a.csv", [lines[0], *rows]))


def test_an_unknown_column_name_lists_the_header(tmp_path):
    message = refusal(write(tmp_path / "a.csv", csv_lines()), columns={"x": "xm"})
    assert (
        "line 1: no column 'xm' (capture.columns.x); its header has t_s, x_m, y_m, z_m, did you mean 'x_m'?" in message
    )


def test_a_name_that_occurs_twice_is_not_guessed(tmp_path):
    lines = ["t_s,x_m,x_m,z_m", *csv_lines()[1:]]
    assert "2 columns 'x_m'" in refusal(write(tmp_path / "a.csv", lines), columns={"y": None})


def test_a_name_without_a_header_row(tmp_path):
    assert "no header row, but capture.columns.x is the name 'x_m'" in refusal(
        write(tmp_path / "a.csv", csv_lines()[1:])
    )


def test_a_missing_column(tmp_path):
    file = write(tmp_path / "a.csv", csv_lines())
    message = refusal(file, columns={"z": 7})
    assert "line 2, column 7 (counted from 1): missing: the row has 4 cells" in message
    assert "capture.columns.z" in message


def test_a_recording_of_hours_is_refused_before_the_work_of_smoothing_it(tmp_path):
    rows = [f"{i * 0.01:.2f},0.1,0.0,0.1" for i in range(100_001)]
    message = refusal(write(tmp_path / "a.csv", [csv_lines()[0], *rows]))
    assert "100001 samples; a demonstration is one swing of at most 100000" in message
    assert "capture.first_row" in message


def test_commas_that_separate_both_columns_and_decimals_are_reported(tmp_path):
    lines = [csv_lines()[0], *(line.replace(".", ",") for line in csv_lines()[1:])]
    message = refusal(write(tmp_path / "a.csv", lines))
    assert "its rows have 8 cells under 4 names: commas stand between columns and before decimals" in message
    assert "export it with semicolons or tabs" in message


def test_a_row_cut_short(tmp_path):
    assert "line 30, column z_m: missing: the row has 3 cells" in refusal(edited(tmp_path, 30, "0.280,0.1,0.0"))


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ("0.280,,0.0,0.0", "is empty"),
        ("0.280,nan,0.0,0.0", "'nan' is not a finite number"),
        ("0.280,inf,0.0,0.0", "'inf' is not a finite number"),
        ("0.280,1.2.3,0.0,0.0", "'1.2.3' is not a finite number"),
        ("0.280,lost,0.0,0.0", "'lost' is not a finite number"),
    ],
)
def test_a_bad_cell_is_named_by_line_column_and_value(tmp_path, text, problem):
    assert f"line 30, column x_m: {problem}" in refusal(edited(tmp_path, 30, text))


def test_a_bad_first_row_is_not_taken_for_a_header(tmp_path):
    assert "line 2, column x_m: 'lost' is not" in refusal(edited(tmp_path, 2, "0.000,lost,0.0,0.0"))


def test_an_empty_line_amid_the_data(tmp_path):
    assert "line 30: an empty line amid the data" in refusal(edited(tmp_path, 30, ""))


def test_a_gap_in_time(tmp_path):
    lines = csv_lines()
    message = refusal(write(tmp_path / "a.csv", lines[:60] + lines[90:]))
    assert "line 61: a gap of 0.31 s, where samples come every 0.01 s" in message
    assert "capture.gap_factor" in message


def test_one_missing_sample_is_bridged(tmp_path):
    t_s, _ = read(edited(tmp_path, 60, None))
    assert len(t_s) == 200


def test_a_gap_without_time_stamps_is_reported_by_the_jump(tmp_path):
    lines = csv_lines()
    message = refusal(write(tmp_path / "a.csv", lines[:85] + lines[115:]), columns={"time": None}, rate_hz=100.0)
    assert "line 86: the position jumps by 0.1" in message


def test_a_marker_that_was_lost_jumps(tmp_path):
    lines = [lines if i != 100 else "0.990,1.5,0.9,0.0" for i, lines in enumerate(csv_lines())]
    assert "the position jumps by" in refusal(write(tmp_path / "a.csv", lines))


@pytest.mark.parametrize("stamp", ["0.200", "0.100"])
def test_time_that_does_not_rise(tmp_path, stamp):
    message = refusal(edited(tmp_path, 30, f"{stamp},0.1,0.0,0.1"))
    assert f"line 30: time does not rise: {float(stamp):.6g} s after 0.27 s" in message


@pytest.mark.parametrize(("rows", "text"), [(1, "one sample only"), (5, "5 samples only")])
def test_too_few_rows(tmp_path, rows, text):
    message = refusal(write(tmp_path / "a.csv", csv_lines()[: rows + 1]))
    assert f"{text}; a demonstration needs at least 10" in message


def test_a_header_alone(tmp_path):
    assert "no data row is left: 0 follow 1 of header" in refusal(write(tmp_path / "a.csv", csv_lines()[:1]))


def test_a_first_row_beyond_the_end(tmp_path):
    assert "no data row is left" in refusal(write(tmp_path / "a.csv", csv_lines()), first_row=500)


@pytest.mark.parametrize("content", [b"", b"\n\n  \n"])
def test_an_empty_file(tmp_path, content):
    file = tmp_path / "a.csv"
    file.write_bytes(content)
    assert "is empty, no row" in refusal(file)


def test_only_comments(tmp_path):
    assert "no data row is left" in refusal(write(tmp_path / "a.csv", ["# one", "# two"]))


def test_binary_rubbish(tmp_path):
    file = tmp_path / "a.csv"
    file.write_bytes(np.random.default_rng(0).bytes(5000))
    assert "not a text file" in refusal(file) or "not UTF-8 text" in refusal(file)


def test_words_instead_of_numbers(tmp_path):
    refusal(write(tmp_path / "a.csv", ["All work and no play", "makes Jack a dull boy."]))


def test_a_missing_file(tmp_path):
    assert "no such file" in refusal(tmp_path / "nowhere.csv")


def test_a_folder(tmp_path):
    assert "is a folder, not a file; set capture.path to a recording, a glob or a list of them, such as" in refusal(
        tmp_path
    )


def test_a_still_hand(tmp_path):
    lines = ["t_s,x_m,y_m,z_m", *(f"{i / 100},0.5,0.0,1.0" for i in range(100))]
    assert "the swing extends over 0 m" in refusal(write(tmp_path / "a.csv", lines))


def test_one_bad_file_among_several_is_named(tmp_path):
    good = write(tmp_path / "good.csv", csv_lines())
    bad = edited(tmp_path, 30, "0.280,nan,0.0,0.0")
    with pytest.raises(InputError, match=r"a\.csv, line 30, column x_m"):
        open_files(file_settings([good, bad]))


@pytest.mark.parametrize(
    ("empty", "remedy"),
    [
        ([60], "delete line 60: the samples around are then joined"),
        ([60, 61, 62], "delete lines 60 to 62 and type capture.gap_factor=4.5"),
    ],
)
def test_a_hole_is_closed_by_what_its_remedy_says(tmp_path, empty, remedy):
    lines = csv_lines()
    holed = [",".join([line.split(",")[0], "", "", ""]) if n in empty else line for n, line in enumerate(lines, 1)]
    assert remedy in refusal(write(tmp_path / "a.csv", holed))
    left = [line for n, line in enumerate(lines, 1) if n not in empty]
    read(write(tmp_path / "b.csv", left), **({"gap_factor": 4.5} if len(empty) > 1 else {}))


def test_a_column_that_ends_early_is_read_up_to_there(tmp_path):
    lines = csv_lines()
    cut = [line if n < len(lines) - 3 else line.split(",")[0] + ",,," for n, line in enumerate(lines)]
    assert f"type capture.last_row={len(lines) - 4}," in refusal(write(tmp_path / "a.csv", cut))
    read(tmp_path / "a.csv", last_row=len(lines) - 4)


def test_a_spreadsheet_is_to_be_saved_as_csv(tmp_path):
    file = tmp_path / "a.xlsx"
    file.write_bytes(b"PK\x03\x04" + bytes(60))
    assert "is a spreadsheet, which is not read; save it as CSV in its program" in refusal(file)
