"""Recordings are told apart by how they begin, and only damaged ones by their endings."""

from __future__ import annotations

from pathlib import Path

import pytest

from kendama_cli.devices.recordings import recording_format as known
from kendama_cli.devices.recordings.recording_format import FORMATS, RecordingFormat, format_of
from kendama_cli.errors import InputError

BEGINNINGS = [
    (b"\x89MCAP0\r\n", known.MCAP),
    (b"#ROSBAG V2.0\n", known.BAG),
    (b"SQLite format 3\0", known.BAG),
    (b"\x02\x50" + bytes(510), known.C3D),
    (b"NO_OF_FRAMES\t3\r\nNO_OF_BODIES\t1\r\n", known.QUALISYS),
    (b"NO_OF_FRAMES\t3\nNO_OF_MARKERS\t1\n", known.QUALISYS),
    (b"\xef\xbb\xbfFormat Version,1.23\n", known.MOTIVE),
    ("Format Version,1.23\n".encode("utf-16"), known.MOTIVE),
    (b"PathFileType\t4\t(X/Y/Z)\ta.trc\r\n", known.TRC),
    (b"Trajectories\r\n100\r\n", known.VICON),
    (b"# cup\nt_s,x_m,y_m,z_m,qw,qx,qy,qz\n", known.STREAM),
]


@pytest.mark.parametrize(("beginning", "form"), BEGINNINGS, ids=lambda one: getattr(one, "name", str(one)))
@pytest.mark.parametrize("name", ["a", "a.csv", "a.mcap", "a.BAG"])
def test_what_is_in_a_file_says_what_it_is_whatever_its_name(
    tmp_path: Path, name: str, beginning: bytes, form: RecordingFormat
) -> None:
    (tmp_path / name).write_bytes(beginning)
    assert format_of(tmp_path / name, remedy="") is form


@pytest.mark.parametrize(("ending", "form"), [(end, one) for one in FORMATS for end in one.endings])
def test_a_damaged_file_is_what_its_ending_says(tmp_path: Path, ending: str, form: RecordingFormat) -> None:
    path = tmp_path / f"a{ending.upper()}"
    path.write_bytes(b"damaged")
    assert format_of(path, remedy="") is form
    assert format_of(path.rename(tmp_path / "a.csv"), remedy="") is known.TABLE


def test_a_folder_is_a_ros_2_bag_or_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="is a folder, not a file; name a file in it"):
        format_of(tmp_path, remedy="", folder_remedy="name a file in it")
    (tmp_path / "metadata.yaml").write_text("rosbag2_bagfile_information: {}\n")
    assert format_of(tmp_path, remedy="") is known.BAG
