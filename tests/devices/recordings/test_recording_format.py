"""Recordings are told apart by how they begin, and only damaged ones by their endings."""

from __future__ import annotations

import gzip
import json
import lzma
import pickle
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
import scipy.io

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


FOREIGN: dict[str, tuple[Callable[[Path], Any], str]] = {
    "a.npy": (lambda path: np.save(path, np.eye(4)), "is an array of NumPy, which is not read; write its columns"),
    "a.mat": (lambda path: scipy.io.savemat(path, {"p": np.eye(4)}), "is a file of MATLAB"),
    "a.csv.gz": (lambda path: path.write_bytes(gzip.compress(b"t_s,x_m\n0,1\n")), "is compressed"),
    "a.csv.xz": (lambda path: path.write_bytes(lzma.compress(b"t_s,x_m\n0,1\n")), "is compressed"),
    "a.zip": (lambda path: zipfile.ZipFile(path, "w").writestr("a.csv", "t_s,x_m\n0,1\n"), "is compressed"),
    "a.json": (lambda path: path.write_text(json.dumps({"x_m": [1.0]})), "is JSON"),
    "a.jsonl": (lambda path: path.write_text(json.dumps({"x_m": 1.0})), "is JSON"),
    "a.pkl": (lambda path: path.write_bytes(pickle.dumps([1.0])), "is a Python pickle"),
    "a.png": (lambda path: cv2.imwrite(str(path), np.zeros((9, 9), np.uint8)), "is a picture"),
    "a.h5": (lambda path: path.write_bytes(b"\x89HDF\r\n\x1a\n\0\0"), "is an HDF5 file"),
}


@pytest.mark.parametrize("name", FOREIGN)
def test_a_file_of_another_program_is_named_whatever_its_ending(tmp_path: Path, name: str) -> None:
    write, told = FOREIGN[name]
    write(tmp_path / name)
    with pytest.raises(InputError, match=told):
        format_of(tmp_path / name, remedy="")
    if name != "a.zip":  # begins as an npz does
        with pytest.raises(InputError, match=told):
            format_of((tmp_path / name).rename(tmp_path / "a.txt"), remedy="")


def test_a_table_of_text_may_end_as_a_file_of_matlab(tmp_path: Path) -> None:
    (tmp_path / "a.mat").write_text("0.0 0.1 0.2\n")  # MATLAB's save -ascii
    assert format_of(tmp_path / "a.mat", remedy="") is known.TABLE


def test_a_folder_is_a_ros_2_bag_or_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="is a folder, not a file; name a file in it"):
        format_of(tmp_path, remedy="", folder_remedy="name a file in it")
    (tmp_path / "metadata.yaml").write_text("rosbag2_bagfile_information: {}\n")
    assert format_of(tmp_path, remedy="") is known.BAG
