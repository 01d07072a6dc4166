"""Every format gives the same track; every damage is told in one line."""

import contextlib
from pathlib import Path

import numpy as np
import pytest

from kendama_cli.errors import InputError
from kendama_cli.plugins.shared.recordings.reader import RecordedTrack, read_tracks
from kendama_cli.schema.foxglove import FrameTransform
from tests.log.made_logs import memory_log
from tests.plugins.shared.flight_files import c3d_bytes, csv_text, motive_text, qualisys_text
from tests.plugins.shared.flights import session

RATE_HZ = 150.0
DATA = Path(__file__).parents[4] / "shared" / "data"


@pytest.fixture(scope="module")
def track():
    made, _ = session(np.random.default_rng(10300), 2, rate_hz=RATE_HZ)
    t = np.arange(len(made.t_s)) / RATE_HZ
    points = made.position_m.copy()
    points[5:8] = np.nan
    return RecordedTrack("ball", t, points)


@pytest.mark.parametrize(
    ("name", "write"),
    [
        ("a.csv", lambda track: csv_text(track).encode()),
        ("a.tsv", lambda track: qualisys_text(track, RATE_HZ).encode()),
        ("b.csv", lambda track: motive_text(track).encode()),
        ("a.c3d", lambda track: c3d_bytes(track, RATE_HZ)),
        ("b.c3d", lambda track: c3d_bytes(track, RATE_HZ, floats=False)),
        ("c.c3d", lambda track: c3d_bytes(track, RATE_HZ, processor=86)),
        ("d.c3d", lambda track: c3d_bytes(track, RATE_HZ, processor=85)),
        ("e.c3d", lambda track: c3d_bytes(track, RATE_HZ, floats=False, processor=86)),
    ],
)
def test_every_format_gives_the_same_track(tmp_path, track, name, write):
    (tmp_path / name).write_bytes(write(track))
    read = read_tracks(tmp_path / name)[-1]
    assert np.allclose(read.t_s, track.t_s, atol=2e-5)
    shown = read.position_m if name != "b.csv" else read.position_m[:, [0, 2, 1]] * [1, -1, 1]
    assert np.allclose(shown, track.position_m, atol=6e-5, equal_nan=True)


def test_mcap_of_ours_is_read(tmp_path, track):
    seen = np.isfinite(track.position_m).all(axis=1)
    log = memory_log()
    for t, point in zip(track.t_s[seen], track.position_m[seen], strict=True):
        log.write("/predict/ball", float(t), FrameTransform("world", "ball", point))
    log.finish(tmp_path / "log.mcap", stage="predict", settings={}, metrics={})
    (read,) = read_tracks(tmp_path / "log.mcap")
    assert read.name == "/predict/ball ball"
    assert np.allclose(read.position_m, track.position_m[seen])


def test_a_sample_with_the_time_of_the_one_before_is_left_out_and_counted(tmp_path):
    (tmp_path / "a.csv").write_text("t_s,x_m,y_m,z_m\n0,1,2,3\n1,1,2,4\n1,9,9,9\n2,1,2,5\n")
    (read,) = read_tracks(tmp_path / "a.csv")
    assert read.repeated == 1
    assert read.t_s.tolist() == [0, 1, 2]
    assert read.position_m[:, 2].tolist() == [3, 4, 5]


@pytest.mark.recording
@pytest.mark.parametrize(
    ("name", "tracks", "samples"),
    [
        ("c3d/Optotrak.c3d", 54, 29), ("diabolo/z_hop_1.csv", 3, 726),
        ("jugglebot/6_throws_minimal_tracking_loss.tsv", 11, 6282),
    ],
)  # fmt: skip
def test_recordings_of_others_are_read(name, tracks, samples):
    if not DATA.is_dir():
        pytest.skip(f"no recordings in {DATA}")
    read = read_tracks(DATA / name)
    assert len(read) == tracks
    assert {len(one.t_s) for one in read} == {samples}
    spread = np.nanmax(np.abs([one.position_m for one in read]))
    assert 0.1 < spread < 5.0  # metres


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        ("a.csv", b"", "is empty, no row; export or record it again, or "),
        ("a.csv", b"time,x\n0,1\n", "line 1: its header lacks t_s, x_m, y_m, z_m; it has time, x"),
        ("a.csv", b"t_s,x_m,y_m,z_m\n0,1,2,3\n1,a,2,3\n", "line 3, column x_m: 'a' is not a number"),
        ("a.csv", b"t_s,x_m,y_m,z_m\n1,1,2,3\n0,1,2,4\n", "sample 2 of 'ball': time does not rise: 0 s after 1 s"),
        ("a.csv", b"t_s,x_m,y_m,z_m\n0,1,2,3\n,1,2,3\n", "time does not rise: nan s after 0 s"),
        ("a.csv", b"\xff\xfe", "its header lacks t_s, x_m, y_m, z_m; it has nothing"),
        ("a.csv", b"abc\x00def", "not a text file"),
        ("a.tsv", b"NO_OF_FRAMES\t3\n", "no NO_OF_MARKERS or FREQUENCY in its header"),
        ("a.tsv", b"NO_OF_FRAMES\t3\nNO_OF_MARKERS\t1\nFREQUENCY\t100\n", "0 data rows of 1 markers at 100 Hz"),
        ("a.csv", b"Format Version,1.22,Length Units,Feet\na\nb\nc\nFrame,X\n1,2\n", "or a unit of length other than"),
        ("a.mcap", b"\x89MCAP0\r\n", "cut short"),
    ],
)  # fmt: skip
def test_what_cannot_be_read_is_told_in_one_line(tmp_path, name, content, message):
    (tmp_path / name).write_bytes(content)
    with pytest.raises(InputError) as caught:
        read_tracks(tmp_path / name)
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_c3d_that_is_cut_short_or_from_an_unknown_machine_is_refused(tmp_path, track):
    path = tmp_path / "a.c3d"
    whole = c3d_bytes(track, RATE_HZ)
    for content, message in (
        (whole[:3003], "is damaged \\(cut short: \\d+ of \\d+ frames"),
        (whole[:515] + b"\1" + whole[516:], "processor type 1, allowed: 84, 85, 86"),
        (whole[:600], "is damaged"),
    ):
        path.write_bytes(content)
        with pytest.raises(InputError, match=message):
            read_tracks(path)


@pytest.mark.parametrize("unit", ["mm", "m"])
def test_a_c3d_that_ezc3d_writes_is_read_as_ezc3d_reads_it(tmp_path, track, unit):
    """The library of others that biomechanics uses; ours refuses what makes it crash (see test_a_flipped_bit)."""
    ezc3d = pytest.importorskip("ezc3d")
    points = np.full((4, 2, len(track.t_s)), 1.0)
    points[:3, 1] = track.position_m.T * (1000 if unit == "mm" else 1)
    made = ezc3d.c3d()
    made["parameters"]["POINT"]["RATE"]["value"] = [RATE_HZ]
    made["parameters"]["POINT"]["UNITS"]["value"] = [unit]
    made["parameters"]["POINT"]["LABELS"]["value"] = ["base", "ball"]
    made["data"]["points"] = points
    path = tmp_path / "a.c3d"
    made.write(str(path))
    theirs = ezc3d.c3d(str(path))["data"]["points"][:3, 1].T * (1e-3 if unit == "mm" else 1)
    base, ball = read_tracks(path)
    assert [base.name, ball.name] == ["base", "ball"]
    assert np.isnan(ball.position_m).all(axis=1).sum() == 3
    assert ball.position_m == pytest.approx(theirs, abs=1e-9, nan_ok=True)
    assert ball.position_m == pytest.approx(track.position_m, abs=1e-6, nan_ok=True)
    assert ball.t_s == pytest.approx(track.t_s, abs=1e-9)


def test_a_flipped_bit_in_the_head_of_a_c3d_is_told_or_harmless(tmp_path, track):
    """Every seventh bit of header and parameters: no crash, no endless loop, nothing but InputError."""
    path, whole = tmp_path / "a.c3d", c3d_bytes(track, RATE_HZ)
    for bit in range(0, 8 * 700, 7):
        damaged = bytearray(whole)
        damaged[bit // 8] ^= 1 << bit % 8
        path.write_bytes(damaged)
        with contextlib.suppress(InputError):
            read_tracks(path)


def test_an_empty_c3d_is_empty_and_not_damaged(tmp_path, track):
    path = tmp_path / "a.c3d"
    whole = bytearray(c3d_bytes(track, RATE_HZ))
    whole[2:4] = b"\0\0"
    path.write_bytes(bytes(whole))
    with pytest.raises(InputError, match="is empty: it has no points"):
        read_tracks(path)


def test_files_that_are_none_are_told(tmp_path):
    with pytest.raises(InputError, match="no such file"):
        read_tracks(tmp_path / "nothing.csv")
    with pytest.raises(InputError, match="is a folder"):
        read_tracks(tmp_path)
