"""Tables that programs keep in columns, as texts of CSV: Parquet (LeRobot's datasets too) and NumPy's npz."""

from __future__ import annotations

import json
import zipfile
from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from kendama_cli.devices.recordings.recording_format import NPZ, RecordingFormat
from kendama_cli.errors import InputError, no_pyarrow

if TYPE_CHECKING:
    import pandas as pd

MOST_BYTES = 700 << 20
MOST_PARTS = 32
"""An array of more columns is no place and no orientation."""
STATE, CUP = "observation.state", "cup."
REMEDY = "export it as CSV with the columns t_s,x_m,y_m,z_m"


def columnar_texts(path: str, form: RecordingFormat) -> list[str]:
    """Return the table in the file, or in each episode of a LeRobot dataset, as CSV with a row of names.

    A column of vectors becomes a column for each number: by the names that the dataset gives, else by x, y, z or the
    index. Raises InputError for a file that is damaged, too large, or holds no table of numbers; MissingPartError
    for Parquet without pyarrow.
    """
    try:
        frames = [_npz(Path(path))] if form is NPZ else _parquet(Path(path))
    except ImportError:
        raise no_pyarrow(path, f"or {REMEDY}") from None
    except (OSError, ValueError, KeyError, zipfile.BadZipFile, MemoryError) as wrong:
        reason = " ".join(str(wrong).split())[:200] or type(wrong).__name__
        raise InputError(path, f"cannot be read as {form.name} ({reason})", remedy=REMEDY) from None
    return [frame.to_csv(index=False) for frame in frames]


def _npz(file: Path) -> pd.DataFrame:
    with zipfile.ZipFile(file) as archive:
        if (size := sum(one.file_size for one in archive.infolist())) > MOST_BYTES:
            raise ValueError(f"{size >> 20} MB unpacked; allowed: {MOST_BYTES >> 20}")
    with np.load(file, allow_pickle=False) as archive:
        arrays = {name: np.asarray(archive[name]) for name in archive.files}
    tables = {name: one for name, one in arrays.items() if one.ndim in (1, 2) and one.dtype.kind in "fiu"}
    lengths = Counter(len(one) for one in tables.values() if len(one) > 1)
    if not lengths:
        raise ValueError("no array of numbers over time")
    count = lengths.most_common(1)[0][0]
    return _flat({name: one for name, one in tables.items() if len(one) == count}, {})


def _parquet(file: Path) -> list[pd.DataFrame]:
    import pandas as pd  # noqa: PLC0415 - a second to import

    files = sorted((file / "data").rglob("*.parquet")) if file.is_dir() else [file]
    if not files or (size := sum(one.stat().st_size for one in files)) > MOST_BYTES:
        raise ValueError(f"{size >> 20} MB; allowed: {MOST_BYTES >> 20}" if files else "no data/*/*.parquet in it")
    table = pd.concat([pd.read_parquet(one) for one in files], ignore_index=True)
    columns: dict[str, Any] = {}
    for name in table:
        cells = table[name].to_list()
        columns[str(name)] = np.array(cells) if len(cells) and isinstance(cells[0], np.ndarray | list) else table[name]
    flat = _flat(columns, _feature_names(file))
    if "x_m" in flat and "timestamp" in flat:  # as 'kendama log export --format lerobot' writes them
        flat = flat.rename(columns={"timestamp": "t_s"})
    return [one for _, one in flat.groupby("episode_index")] if "episode_index" in flat else [flat]


def _feature_names(file: Path) -> dict[str, list[str]]:
    """Return the names of the numbers of each feature of the LeRobot dataset that ``file`` is or belongs to."""
    folders = [file] if file.is_dir() else list(file.resolve().parents)[:3]
    info = next((one for folder in folders if (one := folder / "meta/info.json").is_file()), None)
    features = {} if info is None else json.loads(info.read_text(encoding="utf-8"))["features"]
    return {key: names for key, one in features.items() if isinstance(names := one.get("names"), list)}


def _flat(columns: Mapping[str, Any], named: Mapping[str, Sequence[str]]) -> pd.DataFrame:
    import pandas as pd  # noqa: PLC0415 - as above

    flat: dict[str, Any] = {}
    for name, values in columns.items():
        if values.ndim == 1:
            flat[name] = values
            continue
        width = values.shape[1]
        parts = list(named.get(name, ()))
        if len(parts) != width:
            parts = list("xyz") if width == 3 else [str(i) for i in range(width)]
        for part, column in zip(parts[:MOST_PARTS], values.T, strict=False):
            flat[part.removeprefix(CUP) if name == STATE else f"{name}_{part}"] = column
    return pd.DataFrame(flat)
