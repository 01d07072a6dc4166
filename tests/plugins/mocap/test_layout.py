"""``kendama capture layout``: strangers' tables are read as they were meant, with the evidence for each guess."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import matplotlib.image
import numpy as np
import pandas as pd
import pytest
import yaml
from omegaconf import OmegaConf

from kendama_cli.config.compose import composed
from kendama_cli.config.site import bundled_root, find_site
from kendama_cli.devices.demonstrator.interface import open_demonstrators
from kendama_cli.devices.demonstrator.recording import Recording
from kendama_cli.errors import InputError
from kendama_cli.pipeline.nodes import build_settings, node_schemas
from kendama_cli.plugins.mocap.layout.column_names import named
from kendama_cli.plugins.mocap.layout.fit import liveliest
from kendama_cli.schema.settings import build_value
from tests.cli.typed import kendama, refused
from tests.shipped_conf import plain

QUAT = (0.1, 0.2, 0.3, 0.86**0.5)
"""x, y, z, w of a unit quaternion."""


@pytest.fixture
def swing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> np.ndarray[Any, Any]:
    """A bundled swing (n, 4): t, x, y, z in seconds and metres; the working folder is an empty one."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("KENDAMA_HOME", str(tmp_path / "home"))
    return pd.read_csv(bundled_root() / "data/demonstrations/swing-01.csv", comment="#").to_numpy()


def _write(name: str, columns: Sequence[Any], head: Sequence[str], sep: str = ",", decimal: str = ".") -> str:
    rows = [
        sep.join(cell if isinstance(cell, str) else f"{cell:.9g}".replace(".", decimal) for cell in row)
        for row in zip(*columns, strict=True)
    ]
    Path(name).write_text("\n".join([*head, *rows, ""]), encoding="utf-8")
    return name


def _read(capture: str) -> np.ndarray[Any, Any]:
    """The swing as ``capture=NAME`` gives it (n, 4): t, x, y, z, each from its start."""
    whole = OmegaConf.merge(plain("capture", "file"), OmegaConf.load(f"conf/capture/{capture}.yaml"))
    settings = build_value(node_schemas()[0]["capture"], OmegaConf.to_container(whole), "capture")
    (hand,) = open_demonstrators(settings)
    rows = np.array([[one.t_s, *one.position_m] for one in hand.samples()])
    return rows - rows[0]


def _same_swing(found: np.ndarray[Any, Any], true: np.ndarray[Any, Any]) -> None:
    """z as it was; x up to its sense, which is free, as is y's with it."""
    true = true - true[0]
    assert found[:, 0] == pytest.approx(true[:, 0], abs=2e-4)
    assert found[:, 3] == pytest.approx(true[:, 3], abs=1e-5)
    assert np.abs(found[:, 1]) == pytest.approx(np.abs(true[:, 1]), abs=1e-5)


def test_a_strangers_csv_needs_two_commands(swing: Any, capsys: pytest.CaptureFixture[str]) -> None:
    t_s, x, y, z = swing.T
    head = ["Recorded with a tracker 3.2", "Subject;P01;;", "Date;2024-05-03;;", "Time [ms];X [mm];Y [mm];Z [mm]"]
    _write("day one.csv", 1e3 * np.array([t_s, y, z, x]), head, ";", ",")
    with pytest.raises(InputError, match=r"no column 't_s'.*type: kendama capture layout 'day one\.csv'"):
        open_demonstrators(build_settings(composed(find_site(), ["capture.path='day one.csv'"]))["capture"])
    code, out, _ = kendama(capsys, "capture", "layout", "day one.csv", "-y", "-o", "path.png")
    assert code == 0
    assert out.endswith("written: conf/capture/day_one.yaml\nnext: kendama run capture=day_one\n")
    assert "up           Y [mm]: a simulated ball on a rope rises over the cup in 100%" in out
    assert "mirror       not known" in out
    made = yaml.safe_load(Path("conf/capture/day_one.yaml").read_text())
    columns = {"time": "Time [ms]", "x": "Z [mm]", "y": "X [mm]", "z": "Y [mm]"}
    assert made == {"kind": "file", "path": "day one.csv", "columns": columns, "unit": "mm", "time_unit": "ms"}
    _same_swing(_read("day_one"), swing)
    composed_by_name = build_settings(composed(find_site(), ["capture=day_one"]))["capture"]
    assert (composed_by_name.path, composed_by_name.unit, composed_by_name.columns.x) == ("day one.csv", "mm", "Z [mm]")
    assert matplotlib.image.imread("path.png").std() > 0.01


def _iso(t_s: Any) -> list[str]:
    return [str(pd.Timestamp("2024-05-03T10:00:00") + pd.Timedelta(seconds=one)) for one in t_s]


def _quat(t_s: Any, order: str) -> list[Any]:
    return [np.full(len(t_s), QUAT["xyzw".index(axis)]) for axis in order]


VARIANTS: dict[str, Callable[[Any, Any, Any, Any], tuple[Sequence[Any], list[str], str]]] = {
    "metres, x down, no units": lambda t, x, y, z: ((t, -z, x, -y), ["t,x,y,z"], ","),
    "centimetres, unsaid": lambda t, x, y, z: ((t, 100 * y, 100 * z, 100 * x), ["time,posX,posY,posZ"], ","),
    "inches, in a row of units": lambda t, x, y, z: (
        (t, x / 0.0254, z / 0.0254, -y / 0.0254),
        ["Time\tX\tY\tZ", "s\tin\tin\tin"],
        "\t",
    ),
    "nanoseconds of a clock": lambda t, x, y, z: (
        ([f"{1714730400 * 10**9 + round(one * 1e9)}" for one in t], x, y, z),
        ["timestamp,px,py,pz"],
        ",",
    ),
    "dates": lambda t, x, y, z: ((_iso(t), y, x, -z), ["Date,x,y,z"], ","),
    "no names, millimetres": lambda t, x, y, z: ((t, 1e3 * z, 1e3 * x, 1e3 * y), [], " "),
    "TUM": lambda t, x, y, z: ((t + 1e3, x, z, -y, *_quat(t, "xyzw")), ["# timestamp tx ty tz qx qy qz qw"], " "),
    "TUM without names": lambda t, x, y, z: ((t + 1e3, x, z, -y, *_quat(t, "xyzw")), [], " "),
    "EuRoC": lambda t, x, y, z: (
        ([str(1403636579763555584 + round(one * 1e9)) for one in t], z, x, y, *_quat(t, "wxyz"), x, y, z),
        [
            "#timestamp [ns],p_RS_R_x [m],p_RS_R_y [m],p_RS_R_z [m],q_RS_w [],q_RS_x [],q_RS_y [],q_RS_z [],"
            "v_RS_R_x [m s^-1],v_RS_R_y [m s^-1],v_RS_R_z [m s^-1]"
        ],
        ",",
    ),
    "a second body and a name": lambda t, x, y, z: (
        (t, ["a"] * len(t), 1 + 0.01 * np.sin(t), z, x + 1, x, y, z, *_quat(t, "wxyz")),
        ["Time (s),Marker,base X,base Y,base Z,cup X,cup Y,cup Z,cup qw,cup qx,cup qy,cup qz"],
        ",",
    ),
    "frames and a rate above": lambda t, x, y, z: (
        (np.arange(len(t)), 1e3 * x, 1e3 * z, -1e3 * y),
        ["Sampling rate: 100 Hz", "Units: mm", "frame,x,y,z"],
        ",",
    ),
    "no time and no rate": lambda t, x, y, z: ((1e3 * x, 1e3 * z, -1e3 * y), ["x,y,z"], ","),
    "two axes": lambda t, x, y, z: ((t, x, z), ["t,x,y"], ","),
}


@pytest.mark.parametrize("variant", VARIANTS)
def test_a_table_is_read_as_it_was_meant(variant: str, swing: Any, capsys: pytest.CaptureFixture[str]) -> None:
    _write("mine.csv", *VARIANTS[variant](*swing.T))
    code, out, err = kendama(capsys, "capture", "layout", "mine.csv", "-y")
    assert code == 0, err
    assert "run would refuse" not in out
    _same_swing(_read("mine"), swing)


def test_arrays_of_numpy_and_parquet_are_read(swing: Any, capsys: pytest.CaptureFixture[str]) -> None:
    t_s, x, y, z = swing.T
    place = np.column_stack([x, z, -y])
    np.savez("array.npz", time=t_s, position=place, note=np.array(["by hand"]))
    pd.DataFrame({"timestamp": t_s, "cup": list(1e3 * place)}).to_parquet("vectors.parquet")
    for file in ("array.npz", "vectors.parquet"):
        assert kendama(capsys, "capture", "layout", file, "-y")[0] == 0
        _same_swing(_read(Path(file).stem), swing)


def test_a_persons_swing_on_an_arm_is_read_as_its_publisher_says(
    swing: Any, recordings: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """SOURCES.md: 100 Hz, mm, the swing in columns 2 and 4; the file has neither names nor times."""
    file = recordings / "li-kendama" / "kendama1-20.txt"
    code, out, _ = kendama(capsys, "capture", "layout", str(file), "-y", "--name", "li", "--rate", "100")
    assert code == 0
    made = yaml.safe_load(Path("conf/capture/li.yaml").read_text())
    assert (made["unit"], made["rate_hz"], made["columns"]) == ("mm", 100.0, {"time": None, "x": 2, "y": 3, "z": 4})
    assert "left out: 1.5 s" in out  # the way back


@pytest.mark.parametrize(
    ("file", "why"),
    [
        ("phone/slide/Accelerometer.csv", "no three columns that can be a position; it has Time (s), X (m/s^2)"),
        ("phone/arch-in-hand/Acceleration.csv", "measure accelerations: 9.8 at rest"),
        ("films/trflorian-ball.csv", "no three columns that can be a position"),
        ("kendama-video/images/IMG_4535-0000.jpg", "is a picture, which is not read"),
    ],
)
def test_what_holds_no_places_is_refused(
    swing: Any, recordings: Path, capsys: pytest.CaptureFixture[str], file: str, why: str
) -> None:
    assert why in refused(capsys, "capture", "layout", str(recordings / file), "-y")
    assert not Path("conf").exists()


@pytest.mark.parametrize(
    ("names", "kind"),
    [
        ("Voltage (V),Current (mA),Charge (%),Time To Empty (minutes)", "smooth"),
        ("Chip (degC),Board (\N{DEGREE SIGN}C),Room (K),Air (degrees C)", "smooth"),
        ("W,X,Y,Z", "turns"),
        ("W Element,X Element,Y Element,Z Element", "turns"),
        ("Element 11,Element 12,Element 13,Note", "directions"),
        ("address,value,fixed,name", "gaps"),
    ],
)
def test_other_quantities_of_a_swing_are_no_places(
    swing: Any, capsys: pytest.CaptureFixture[str], names: str, kind: str
) -> None:
    """They move as smoothly as a hand, so that only names, units or lengths tell."""
    offset = np.array([0.7, 0.3, 0.2, 0.5])
    four = offset + np.column_stack([swing[:, 1:], swing[:, 1]])
    if kind != "smooth":
        counted = 3 if kind == "directions" else 4
        four /= np.linalg.norm(four[:, :counted], axis=1)[:, None]
    columns: list[Any] = [swing[:, 0], *four.T]
    if kind == "directions":
        columns[-1] = ["fine"] * len(swing)
    if kind == "gaps":  # no row has three numbers side by side
        columns[1:] = [[f"{x:.4f}" if (row + k) % 2 else "" for row, x in enumerate(four[:, k])] for k in range(4)]
    _write("other.csv", columns, [f"Time (s),{names}"])
    assert "no three columns that can be a position" in refused(capsys, "capture", "layout", "other.csv", "-y")


def test_a_long_session_is_judged_by_its_liveliest_minute(swing: Any) -> None:
    t_s = np.arange(0.0, 200.0, 0.01)
    place = np.zeros((len(t_s), 3))
    place[12000 : 12000 + 3000, 2] = np.sin(t_s[:3000])
    part = liveliest(Recording("long.csv", "", t_s, place, str, "", ""))
    assert part.t_s[0] == 0.0
    assert part.t_s[-1] == pytest.approx(60.0, abs=0.02)
    assert np.ptp(part.position_m[:, 2]) == pytest.approx(2.0, abs=1e-3)
    short = Recording("short.csv", "", t_s[:100], place[:100], str, "", "")
    assert liveliest(short) is short


def test_a_motion_that_is_no_swing_is_called_so(
    swing: Any, recordings: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A heel marker of somebody who walks."""
    code, out, _ = kendama(capsys, "capture", "layout", str(recordings / "phone/stride/truth.csv"))
    assert code == 0
    assert "with no axis up does a ball on a rope rise" in out
    assert out.endswith("nothing is written; to write conf/capture/truth.yaml, add -y\n")


def test_another_layout_and_a_name_of_ours_are_not_overwritten(swing: Any, capsys: pytest.CaptureFixture[str]) -> None:
    _write("mine.csv", swing.T, ["t,x,y,z"])
    assert kendama(capsys, "capture", "layout", "mine.csv", "-y")[0] == 0
    assert kendama(capsys, "capture", "layout", "mine.csv", "-y")[0] == 0
    _write("mine.csv", (1e3 * swing).T, ["t,x,y,z"])
    assert "is there already with another layout" in refused(capsys, "capture", "layout", "mine.csv", "-y")
    assert "kendama has capture=mocap itself" in refused(
        capsys, "capture", "layout", "mine.csv", "-y", "--name", "mocap"
    )


@pytest.mark.parametrize(
    ("label", "meaning"),
    [
        ("Time (Seconds)", ("time", "", "", None, "s")),
        ("timestamp_ns", ("time", "", "", None, "ns")),
        ("p_RS_R_x [m]", ("place", "x", "rs r", "m", None)),
        ("x_mm", ("place", "x", "", "mm", None)),
        ("cup:TX", ("place", "x", "cup", None, None)),
        ("Hand Position Y", ("place", "y", "hand", None, None)),
        ("posZ", ("place", "z", "", None, None)),
        ("qw", ("turn", "w", "", None, None)),
        ("pose.orientation.z", ("turn", "z", "pose", None, None)),
        ("v_RS_R_x [m s^-1]", ("other", "", "", None, None)),
        ("ax_m_s2", ("other", "", "", None, None)),
        ("X (m/s^2)", ("other", "", "", None, None)),
        ("roll", ("other", "", "", None, None)),
    ],
)
def test_a_columns_name_tells_its_quantity(label: str, meaning: tuple[str | None, ...]) -> None:
    found = named(label)
    assert (found.kind, found.axis, found.body, found.length, found.time) == meaning
