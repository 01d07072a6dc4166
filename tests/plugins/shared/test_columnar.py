"""Parquet and npz as tables, and LeRobot's datasets as one table an episode."""

from __future__ import annotations

import io
import sys
import zipfile
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from kendama_cli.devices.recordings.columnar import columnar_texts
from kendama_cli.devices.recordings.recording_format import NPZ, PARQUET
from kendama_cli.errors import InputError, MissingPartError
from kendama_cli.plugins.shared.recordings.reader import read_bodies


def test_vectors_become_columns_by_axis(tmp_path: Path) -> None:
    np.savez(tmp_path / "a.npz", t_s=[0.0, 0.1], pos=[[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]], q=np.eye(4)[:2], one=[7.0])
    (text,) = columnar_texts(str(tmp_path / "a.npz"), NPZ)
    assert text.splitlines()[0] == "t_s,pos_x,pos_y,pos_z,q_0,q_1,q_2,q_3"
    assert text.splitlines()[2] == "0.1,4.0,5.0,6.0,0.0,1.0,0.0,0.0"


def test_a_table_with_our_names_is_a_body(tmp_path: Path) -> None:
    frame = pd.DataFrame({"t_s": [0.0, 0.1], "x_m": [1.0, 2.0], "y_m": [3.0, 4.0], "z_m": [5.0, 6.0]})
    frame.to_parquet(tmp_path / "a.parquet")
    (body,) = read_bodies(str(tmp_path / "a.parquet"))
    assert body.position_m.tolist() == [[1.0, 3.0, 5.0], [2.0, 4.0, 6.0]]


def test_objects_of_python_are_never_loaded(tmp_path: Path) -> None:
    np.savez(tmp_path / "a.npz", t=np.array([{}, {}], dtype=object))
    with pytest.raises(InputError, match="cannot be read as an npz"):
        columnar_texts(str(tmp_path / "a.npz"), NPZ)


def test_a_bomb_is_not_unpacked(tmp_path: Path) -> None:
    made = io.BytesIO()
    with zipfile.ZipFile(made, "w", zipfile.ZIP_DEFLATED) as archive:
        for number in range(3):
            archive.writestr(f"{number}.npy", b"\0" * (300 << 20))
    (tmp_path / "a.npz").write_bytes(made.getvalue())
    with pytest.raises(InputError, match="900 MB unpacked; allowed: 700"):
        columnar_texts(str(tmp_path / "a.npz"), NPZ)


def test_without_pyarrow_a_parquet_says_what_to_install(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pd.DataFrame({"t_s": [0.0]}).to_parquet(tmp_path / "a.parquet")
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    with pytest.raises(MissingPartError, match=r"Parquet needs pyarrow; pip install .* or export it as CSV"):
        columnar_texts(str(tmp_path / "a.parquet"), PARQUET)


def test_a_damaged_parquet_is_one_line(tmp_path: Path) -> None:
    (tmp_path / "a.parquet").write_bytes(b"PAR1 and no more")
    with pytest.raises(InputError, match="cannot be read as a Parquet table"):
        columnar_texts(str(tmp_path / "a.parquet"), PARQUET)
