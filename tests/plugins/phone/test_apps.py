"""Files as the apps write them by their documentation, and what is refused with what to do."""

from __future__ import annotations

import zipfile

import numpy as np
import pytest

from kendama_cli.errors import ConfigError, InputError
from kendama_cli.plugins.phone import files
from kendama_cli.plugins.phone.files import read_exports
from kendama_cli.plugins.phone.swings import open_phone
from kendama_cli.plugins.phone.tables import gravity_sign, signals_of
from tests.plugins.phone.phones import bundled_swing, settings, take

TAKE = take(np.random.default_rng(4), bundled_swing(4))
EPOCH_MS = 1_764_073_296_509


def table(head, columns, mark=",", decimal=".", form="{:.9E}"):
    rows = [mark.join(form.format(value).replace(".", decimal) for value in row) for row in np.column_stack(columns)]
    return "\n".join([head, *rows]) + "\n"


def packed(path, **tables):
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, text in tables.items():
            archive.writestr(name.replace("__", "/") + ".csv", text)
    return str(path)


def read(path, **changes):
    (export,) = read_exports((path,) if isinstance(path, str) else tuple(path))
    return signals_of(export, settings(path, **changes))


def check(path, **changes):
    """Hold both sensors against those that were written, and the path's height against the truth."""
    force, rate = read(path, **changes)
    scale = 9.80665 if np.linalg.norm(force.values[0]) < 2 else 1.0
    assert scale * force.values[50:60] == pytest.approx(TAKE.force[50:60], abs=2e-3)
    turn = np.pi / 180 if rate.unit == "deg" else 1.0
    assert turn * rate.values[50:60] == pytest.approx(TAKE.rate[50:60], abs=1e-4)
    (hand,) = open_phone(settings(path, **changes))
    heights = np.array([sample.position_m[2] for sample in hand.samples()])
    assert np.ptp(heights) == pytest.approx(np.ptp(TAKE.true_m[:, 2]), abs=0.03)


FORMS = {
    "comma": (",", "."),
    "tab": ("\t", "."),
    "semicolon": (";", "."),
    "tab, comma": ("\t", ","),
    "excel": (";", ","),
}


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("heads", ["{} ({})", "Acceleration {} ({})|Gyroscope {} ({})"])
def test_phyphox_in_its_five_forms_and_both_styles_of_heads(tmp_path, form, heads):
    mark, decimal = FORMS[form]
    acceleration, rotation = heads.split("|") if "|" in heads else (heads, heads)
    axes = "xyz" if "|" in heads else "XYZ"

    def head(style, unit, absolute):
        names = ["Time (s)", *(style.format(axis, unit) for axis in axes), absolute]
        return mark.join(f'"{name}"' for name in names)

    size = np.linalg.norm(TAKE.force, axis=1)
    acc = table(head(acceleration, "m/s^2", "Absolute (m/s^2)"), [TAKE.t_s, TAKE.force, size], mark, decimal)
    gyr = table(head(rotation, "rad/s", "Absolute (rad/s)"), [TAKE.t_s, TAKE.rate, size], mark, decimal)
    check(packed(tmp_path / "a.zip", Accelerometer=acc, Gyroscope=gyr, meta__device='"property","value"\n"a","b"\n'))


def test_a_folder_of_phyphox_is_one_recording(tmp_path):
    head = '"Time (s)","X ({0})","Y ({0})","Z ({0})"'
    (tmp_path / "Accelerometer.csv").write_text(table(head.format("m/s^2"), [TAKE.t_s, TAKE.force]))
    (tmp_path / "Gyroscope.csv").write_text(table(head.format("rad/s"), [TAKE.t_s, TAKE.rate]))
    check([str(one) for one in sorted(tmp_path.glob("*.csv"))])


def logger(sign=1, meta="android,false", **others):
    """A zip's tables as Sensor Logger writes them: nanoseconds, and the axes in the order z, y, x."""
    stamps = (EPOCH_MS * 10**6 + np.round(TAKE.t_s * 1e9)).astype(np.int64)

    def text(values):
        rows = [
            f"{stamp},{t:.9f},{row[2]:.7f},{row[1]:.7f},{row[0]:.7f}"
            for stamp, t, row in zip(stamps, TAKE.t_s, values, strict=True)
        ]
        return "\n".join(["time,seconds_elapsed,z,y,x", *rows]) + "\n"

    tables = {"TotalAcceleration": text(sign * TAKE.force), "Gyroscope": text(TAKE.rate)}
    tables["Accelerometer"] = text(TAKE.force - TAKE.force[0])
    if meta is not None:
        platform, standard = meta.split(",")
        tables["Metadata"] = f"version,device name,platform,standardisation\n3,phone,{platform},{standard}\n"
    return tables | others


@pytest.mark.parametrize(("meta", "sign"), [("android,false", 1), ("ios,true", 1), ("ios,false", -1)])
def test_sensor_logger_and_the_sign_that_its_metadata_tells(tmp_path, meta, sign):
    path = packed(tmp_path / "a.zip", **logger(sign, meta))
    (export,) = read_exports((path,))
    force, _ = read(path)
    assert gravity_sign(export, settings(path)) == sign
    assert sign * force.values[50:60] == pytest.approx(TAKE.force[50:60], abs=1e-6)
    (hand,) = open_phone(settings(path))
    heights = np.array([sample.position_m[2] for sample in hand.samples()])
    assert heights.max() - heights[0] == pytest.approx(np.max(TAKE.true_m[:, 2] - TAKE.true_m[0, 2]), abs=0.03)


def test_sensor_logger_without_metadata_asks_for_the_sign(tmp_path):
    path = packed(tmp_path / "a.zip", **logger(meta=None))
    with pytest.raises(InputError, match=r"Metadata\.csv is missing.*set capture\.sign=1 .* or -1 \(iOS\)"):
        open_phone(settings(path))
    assert len(open_phone(settings(path, sign=1))) == 1


def test_sensor_logger_without_gravity_asks_for_the_total_acceleration(tmp_path):
    tables = logger()
    del tables["TotalAcceleration"]
    with pytest.raises(InputError, match=r"holds acceleration without gravity; .*'Total Acceleration'"):
        open_phone(settings(packed(tmp_path / "a.zip", **tables)))


@pytest.mark.parametrize("stamps", ["unix", "date"])
def test_matlab_mobile_with_two_files_that_begin_apart(tmp_path, stamps):
    def text(t_s, values):
        if stamps == "unix":
            times, head = [f"{EPOCH_MS + round(1e3 * t)}" for t in t_s], "timestamp"
        else:
            start = np.datetime64("2025-11-25T12:07:58.000")
            plain = [str(start + np.timedelta64(round(1e3 * t), "ms")) for t in t_s]
            times, head = [f"25-Nov-2025 {one[11:]}" for one in plain], "Timestamp"
        rows = [",".join([time, *(f"{v:.6f}" for v in row)]) for time, row in zip(times, values, strict=True)]
        return "\n".join([f"{head},X,Y,Z", *rows]) + "\n"

    acceleration = text(TAKE.t_s[8:], TAKE.force[8:])
    path = packed(tmp_path / "a.zip", Acceleration=acceleration, AngularVelocity=text(TAKE.t_s, TAKE.rate))
    force, rate = read(path)
    assert force.t_s[0] - rate.t_s[0] == pytest.approx(0.08, abs=0.01)
    (hand,) = open_phone(settings(path))
    heights = np.array([sample.position_m[2] for sample in hand.samples()])
    assert np.ptp(heights) == pytest.approx(np.ptp(TAKE.true_m[:, 2]), abs=0.03)


def test_physics_toolbox_in_g(tmp_path):
    file = tmp_path / "a.csv"
    columns = [TAKE.t_s, TAKE.force / 9.80665, TAKE.rate]
    file.write_text(table("time,gFx,gFy,gFz,wx,wy,wz", columns, form="{:.7f}"))
    check(str(file))


def test_any_table_by_named_columns_in_degrees(tmp_path):
    file = tmp_path / "a.csv"
    head = "when,gx (deg/s),gy (deg/s),gz (deg/s),fx,fy,fz"
    file.write_text(table(head, [1e3 * TAKE.t_s, np.degrees(TAKE.rate), TAKE.force], form="{:.6f}"))
    names = {"time": "when", "ax": "fx", "ay": "fy", "az": "fz"}
    names |= {f"w{axis}": f"g{axis} (deg/s)" for axis in "xyz"}
    check(str(file), columns=names)
    with pytest.raises(InputError, match=r"no column 'fq'; it has when, gx"):
        open_phone(settings(str(file), columns=names | {"az": "fq"}))
    with pytest.raises(ConfigError, match="name all seven columns or none; named: time"):
        settings(str(file), columns={"time": "when"})


HEAD = '"Time (s)","X (m/s^2)","Y (m/s^2)","Z (m/s^2)"'
GYRO = '"Time (s)","X (rad/s)","Y (rad/s)","Z (rad/s)"'


def test_acceleration_without_gravity_is_refused_by_name_and_by_size(tmp_path):
    linear = table(HEAD, [TAKE.t_s, TAKE.force - TAKE.force[:80].mean(axis=0)])
    gyroscope = table(GYRO, [TAKE.t_s, TAKE.rate])
    path = packed(tmp_path / "a.zip", **{"Linear Accelerometer": linear, "Gyroscope": gyroscope})
    with pytest.raises(InputError, match=r"holds acceleration without gravity; .*'Acceleration with g'"):
        open_phone(settings(path))
    path = packed(tmp_path / "b.zip", Accelerometer=linear, Gyroscope=gyroscope)
    with pytest.raises(InputError, match=r"at rest is 0\.\d+; .* without gravity; .*'Acceleration with g'"):
        open_phone(settings(path))


def test_a_missing_gyroscope_and_a_slow_rate_are_told(tmp_path):
    force = table(HEAD, [TAKE.t_s, TAKE.force])
    with pytest.raises(InputError, match=r"no rotation rate found in Accelerometer \(Time .*record the gyroscope too"):
        open_phone(settings(packed(tmp_path / "a.zip", Accelerometer=force)))
    slow = [table(head, [TAKE.t_s[::10], one[::10]]) for head, one in ((HEAD, TAKE.force), (GYRO, TAKE.rate))]
    with pytest.raises(
        InputError, match=r"samples come every 0\.\d+, .* 50 to 500 Hz are needed; set the app to 100 Hz"
    ):
        open_phone(settings(packed(tmp_path / "b.zip", Accelerometer=slow[0], Gyroscope=slow[1])))


def test_excel_files_are_refused_with_what_to_choose(tmp_path):
    (tmp_path / "a.xls").write_bytes(b"\xd0\xcf\x11\xe0" + bytes(100))
    with pytest.raises(InputError, match=r"is an Excel file; export it as CSV .*'CSV \(Comma, decimal point\)'"):
        open_phone(settings(str(tmp_path / "a.xls")))
    with zipfile.ZipFile(tmp_path / "b.zip", "w") as archive:
        archive.writestr("[Content_Types].xml", "")
    with pytest.raises(InputError, match="holds an Excel file"):
        open_phone(settings(str(tmp_path / "b.zip")))


def test_archives_are_bounded(tmp_path, monkeypatch):
    monkeypatch.setattr(files, "MAX_BYTES", 1 << 20)
    bomb = packed(tmp_path / "a.zip", Accelerometer="0" * (2 << 20))
    with pytest.raises(InputError, match="more than 1 MB unpacked"):
        open_phone(settings(bomb))
    many = packed(tmp_path / "b.zip", **{f"t{i}": "" for i in range(files.MAX_FILES + 1)})
    with pytest.raises(InputError, match="501 files in the zip; allowed: 500"):
        open_phone(settings(many))
    whole = (tmp_path / "a.zip").read_bytes()
    (tmp_path / "c.zip").write_bytes(whole[:60] + bytes(40) + whole[100:])
    with pytest.raises(InputError, match=r"cannot be unpacked|is no table|MB unpacked"):
        open_phone(settings(str(tmp_path / "c.zip")))
    with zipfile.ZipFile(tmp_path / "d.zip", "w") as archive:
        archive.writestr("a.json", "{}")
    with pytest.raises(InputError, match=r"no table in the zip; it has a\.json"):
        open_phone(settings(str(tmp_path / "d.zip")))


def toolbox(t_s=TAKE.t_s, force=TAKE.force / 9.80665, rate=TAKE.rate, form="{:.7f}"):
    return table("time,gFx,gFy,gFz,wx,wy,wz", [t_s, force, rate], form=form)


def rows(order):
    return toolbox(TAKE.t_s[order], TAKE.force[order] / 9.80665, TAKE.rate[order])


COUNT = len(TAKE.t_s)


@pytest.mark.parametrize(
    "order",
    [
        np.repeat(np.arange(COUNT), 2),
        np.r_[0:200, 190:COUNT],
        np.r_[0:200, 201, 200, 202:COUNT],
    ],
    ids=["twice", "ten again", "late"],
)
def test_rows_that_stand_twice_or_late_change_nothing(tmp_path, order):
    (tmp_path / "a.csv").write_text(rows(order))
    (tmp_path / "b.csv").write_text(toolbox())
    found, right = (read(str(tmp_path / name)) for name in ("a.csv", "b.csv"))
    for one, other in zip(found, right, strict=True):
        assert np.array_equal(one.t_s, other.t_s)
        assert np.array_equal(one.values, other.values)


BACK = np.where(np.arange(COUNT) < 150, TAKE.t_s, TAKE.t_s - 0.5)
AHEAD = np.where(np.arange(COUNT) < 150, TAKE.t_s, TAKE.t_s + 30)


@pytest.mark.parametrize(
    ("text", "told"),
    [
        (rows(np.arange(COUNT)[::-1]), r"row 7: the times go back, to 6 samples before"),
        (toolbox(BACK), r"row 151: the times go back, to 50 samples before"),
        (toolbox(AHEAD), r"1\.\d+ s: no sample of the accelerometer for 300\d\d ms; allowed: 1000"),
        (toolbox(0 * TAKE.t_s), r"1 different times with numbers beside them, in \d+ rows"),
        (toolbox(force=np.nan * TAKE.force), r"0 different times with numbers"),
        (toolbox(force=1e300 * TAKE.force, form="{:.6e}"), r"0 different times with numbers"),
        (toolbox(force=100 * TAKE.force), r"the acceleration is \d+ in the median; gravity is 9\.8 m/s\^2, or 1 g"),
        (toolbox().replace(".", ","), r"14 cells in the first row, 7 in the head"),
        ("time,gFx,gFy,gFz,wx,wy,wz\n", r"0 different times with numbers beside them, in 0 rows"),
    ],
)
def test_stamps_and_numbers_that_no_phone_gives_are_told_by_their_own_names(tmp_path, text, told):
    (tmp_path / "a.csv").write_text(text)
    with pytest.raises(InputError, match=rf"a\.csv.*{told}"):
        open_phone(settings(str(tmp_path / "a.csv")))


@pytest.mark.parametrize("extra", ["", HEAD + "\n", "a,b\n1,2,3\n"])
def test_a_table_that_is_not_needed_may_be_empty_or_broken(tmp_path, extra):
    tables = {"Accelerometer": table(HEAD, [TAKE.t_s, TAKE.force]), "Gyroscope": table(GYRO, [TAKE.t_s, TAKE.rate])}
    check(packed(tmp_path / "a.zip", **tables, **{"Linear Acceleration": extra}))


def test_each_table_with_both_sensors_is_a_recording_and_a_second_pair_of_tables_is_refused(tmp_path):
    assert len(open_phone(settings(packed(tmp_path / "a.zip", monday=toolbox(), tuesday=toolbox())))) == 2
    force, rate = table(HEAD, [TAKE.t_s, TAKE.force]), table(GYRO, [TAKE.t_s, TAKE.rate])
    pairs = {"Accelerometer": force, "Gyroscope": rate, "Accelerometer (1)": force, "Gyroscope (1)": rate}
    with pytest.raises(InputError, match=r"hold the acceleration twice; give each recording a folder of its own"):
        open_phone(settings(packed(tmp_path / "b.zip", **pairs)))


@pytest.mark.parametrize("encoding", ["utf-8-sig", "utf-16"])
@pytest.mark.parametrize("ends", ["\r\n", "\r"])
def test_marks_of_the_byte_order_and_ends_of_lines(tmp_path, encoding, ends):
    (tmp_path / "a.csv").write_bytes(toolbox().replace("\n", ends).encode(encoding))
    check(str(tmp_path / "a.csv"))
